"""How CAM systems write stock, tools and material into comments: one reader per file (`camcomp/plugins/comments.py`)."""
