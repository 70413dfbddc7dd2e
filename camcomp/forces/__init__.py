"""One file per cutting force model, each with a class Params and a function `force`."""
