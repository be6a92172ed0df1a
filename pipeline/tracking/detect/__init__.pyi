from .blobs import LatticeDetection as LatticeDetection
from .blobs import classify_markings as classify_markings
from .blobs import detect_lattice as detect_lattice
from .blobs import detection_summary as detection_summary
from .blobs import orientation_text as orientation_text
from .blobs import specimen_orientation as specimen_orientation
from .blobs import with_distortion as with_distortion
from .relocalise import Relocaliser as Relocaliser
