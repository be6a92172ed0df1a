from .blobs import Sighting as Sighting
from .blobs import lies as lies
from .blobs import placed as placed
from .blobs import refined as refined
from .blobs import sight as sight
from .blobs import told as told
from .markings import shown_on as shown_on
from .relocalise import Recovery as Recovery
