from . import bill_of_materials as bill_of_materials
from . import manifest as manifest
from .assembly_sheet import write as write
from .pdf_paper import GREY as GREY
from .pdf_paper import INK as INK
from .pdf_paper import POINT as POINT
from .pdf_paper import Paper as Paper
from .pdf_paper import PdfDocument as PdfDocument
