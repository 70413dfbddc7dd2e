"""One file per cutting force model, each with PARAMS and a function `force`."""
