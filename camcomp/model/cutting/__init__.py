"""Where along a path the tool cuts and what it feels there, for whatever force model is on the shelf."""
