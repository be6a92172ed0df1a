from .movie_list import showing as showing
