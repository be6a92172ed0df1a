from .id_placement import orientation_mark as orientation_mark
from .id_placement import place_id as place_id
from .stroke_font import text_extent as text_extent
from .stroke_font import text_strokes as text_strokes
from .stroke_font import transformed as transformed
