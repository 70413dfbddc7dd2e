"""The one catalogue of rule ids: what `camcomp explain` says, and the hint an error gives when it has no better one.

CC1xx NC programs · CC2xx usage, YAML, config · CC3xx physics · CC4xx logs, experiments · CC5xx input and output ·
CC6xx checks. An id is never given a second meaning; a retired id is not used again.
"""

from typing import NamedTuple


class Rule(NamedTuple):
    """One way in which an input can be refused."""

    title: str
    explanation: str
    hint: str = ""


RULES: dict[str, Rule] = {
    # --- CC1xx NC programs -------------------------------------------------------------------------------------
    # --- CC2xx usage, YAML, config -----------------------------------------------------------------------------
    "CC200": Rule(
        "YAML cannot be read",
        "The text is not valid YAML 1.2: an unclosed bracket, a wrong indent, a missing colon.",
        "YAML structure is made of spaces; look at the line and at the one before it",
    ),
    "CC201": Rule(
        "unknown key",
        "No section of camcomp has a key of this name here. Keys are never ignored silently, so that a typing mistake "
        "cannot switch off part of the model.",
    ),
    "CC202": Rule(
        "unit missing in a key",
        "Every physical key ends in its unit: `stiffness_N_per_mm`, not `stiffness`. The number alone does not say "
        "whether it is N/mm or N/m.",
    ),
    "CC203": Rule("key missing", "A key without a default is not there."),
    "CC204": Rule(
        "wrong type", "The value has another type than the key asks for, e.g. a word where a number is due."
    ),
    "CC205": Rule(
        "value not allowed",
        "The value has the right type and is still refused: outside its range, or not one of the names allowed.",
    ),
    "CC206": Rule(
        "number not finite",
        "NaN and infinity are no machine properties. A rigid spring is written by leaving the spring out.",
        "leave the key out where it is optional; a missing stiffness means rigid",
    ),
    "CC207": Rule(
        "key given twice",
        "The same mapping names a key twice; which of the two was meant cannot be known.",
        "delete one of the two",
    ),
    "CC208": Rule(
        "matrix not usable",
        "A compliance or stiffness matrix has 6 rows of 6 numbers, is symmetric, and is positive definite: a spring "
        "gives way in the direction of the force and stores energy in every direction. A compliance may have a row "
        "and its column all zero; the link is rigid in that direction.",
    ),
    "CC209": Rule(
        "limits in wrong order", "The lower limit has to be below the upper one.", "write [low, high]"
    ),
    "CC210": Rule(
        "tab in the indentation",
        "YAML forbids tabs in indentation, because their width is not defined.",
        "replace tabs by spaces",
    ),
    "CC211": Rule(
        "empty file", "The file has no content but perhaps comments.", "`camcomp init DIR` writes a start"
    ),
    "CC212": Rule(
        "section missing",
        "The configuration as a whole (all --config files together) lacks a section that this command needs.",
    ),
    "CC213": Rule(
        "unknown plug-in",
        "Robots, dialects, force models and effects are found by their file name in camcomp/robots, camcomp/dialects, "
        "camcomp/forces and camcomp/effects, or through an entry point of the group camcomp.robots, camcomp.dialects, "
        "camcomp.forces or camcomp.effects.",
    ),
    "CC214": Rule("rule id unknown", "There is no rule of this id.", "ids look like CC201"),
    "CC215": Rule(
        "keys that exclude each other",
        "Exactly one of several ways to say the same thing has to be chosen, e.g. a link by its compliance, its "
        "stiffness or its beam section.",
    ),
    # --- CC3xx physics -----------------------------------------------------------------------------------------
    # --- CC4xx logs, experiments -------------------------------------------------------------------------------
    # --- CC5xx input and output --------------------------------------------------------------------------------
    "CC500": Rule("file cannot be read", "The file is not there, or may not be read.", "check the path"),
    "CC501": Rule("file cannot be written", "The folder is not there, is full, or may not be written to."),
    "CC502": Rule(
        "output is the input",
        "An output names the file that is being read. The input is never overwritten.",
        "choose another name for the output",
    ),
    # --- CC6xx checks ------------------------------------------------------------------------------------------
}
