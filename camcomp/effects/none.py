"""No effect: the smallest member of the shelf, for configs that want to say so."""

STAGE = "sensor"
TARGET = "machine"
PARAMETERS = ()
SOURCE = "definition"
