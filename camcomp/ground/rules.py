"""Catalogue of rule ids: texts of `camcomp explain`, and default hints of errors.

CC1xx NC programs · CC2xx usage, YAML, config · CC3xx physics · CC4xx logs, experiments · CC5xx input and output ·
CC6xx checks. An id is never given a second meaning; a retired id is not used again.
"""

from typing import NamedTuple


class Rule(NamedTuple):
    """One reason to refuse an input."""

    title: str
    explanation: str
    hint: str = ""


RULES: dict[str, Rule] = {
    # --- CC1xx NC programs -------------------------------------------------------------------------------------
    "CC100": Rule(
        "program moves nothing",
        "The file holds no motion: it is empty, a comment only, or ends before the first move.",
        "is this the right file?",
    ),
    "CC101": Rule(
        "decimal comma",
        "Controls read `X1,5` as X1, as X15, or not at all. It is refused, because the tool could cut at the wrong position.",
        "write a point",
    ),
    "CC102": Rule(
        "number malformed",
        "A number is digits with at most one point and a sign in front, without blanks inside: `X1.2.3` and `X1 0` "
        "are read differently by different controls.",
        "write the number with digits and one point, e.g. X12.5",
    ),
    "CC103": Rule(
        "letter or number alone",
        "Every word is a letter followed by its number.",
        "put the letter and its number together, or take the stray sign out",
    ),
    "CC104": Rule(
        "word twice in a block",
        "A block may hold each letter once (G and M excepted). Which of two X words counts differs between controls.",
        "delete one of the two, or split the line",
    ),
    "CC105": Rule(
        "codes exclude each other",
        "Two codes of one modal group stand in a block, e.g. G0 and G1, or G90 and G91.",
        "keep one of the two, or split the line",
    ),
    "CC106": Rule(
        "unknown code",
        "camcomp does not know the code, so it cannot know whether it changes the geometry of what follows.",
        "check the dialect (--dialect, or control: dialect: in the YAML)",
    ),
    "CC107": Rule(
        "unknown character",
        "The character has no meaning at this place of a program.",
        "take the character out, or put it into a comment",
    ),
    "CC108": Rule(
        "axis words without a clear user",
        "Two codes in the block want the axis words, or the code with which they stand has no use for them, as in "
        "`G4 X1.5`, which dwells on one control and moves on another.",
        "split the line",
    ),
    "CC109": Rule(
        "word not used",
        "Nothing in the block uses the word. On some controls such a word has a meaning that changes the geometry, "
        "e.g. a corner radius.",
        "delete the word if it has no purpose",
    ),
    "CC110": Rule(
        "feed missing",
        "A cutting motion is due and no feed was given in the feed mode in force; a change of the feed mode "
        "(G93, G94, G95) makes the old one void.",
        "add an F word",
    ),
    "CC111": Rule(
        "arc radii differ",
        "Start and end of the arc are not equally far from the centre given by I, J, K, by more than controls allow. "
        "Usual reasons: centres meant absolute (G90.1), a lost line, the wrong plane.",
        "check I, J, K against the start point, G90.1/G91.1 and the plane (G17, G18, G19)",
    ),
    "CC112": Rule(
        "arc not defined",
        "Centre or radius are missing, contradict each other, or do not lead to the end point.",
        "give the end point with I and J (G17), I and K (G18), J and K (G19), or with R",
    ),
    "CC113": Rule(
        "turns of an arc",
        "P in an arc block counts turns: a whole number, 1 to 1000.",
        "write P with a whole number, 1 or more, or leave it out",
    ),
    "CC114": Rule(
        "cutter radius compensation",
        "With G41 or G42 the control offsets the path by a radius that the program does not contain, so the point "
        "where the tool touches is not known here.",
        "post the program with the tool's centre line (G40)",
    ),
    "CC115": Rule(
        "rotary or extra axis",
        "A, B, C, U, V or W moves an axis that the machine of the configuration does not have, or a rotary table turns "
        "while X, Y or Z move. Turned alone, a table leaves the tool and its correction where they are.",
        "post the program for three axes, or name tables that only position the workpiece in control.table_axes",
    ),
    "CC116": Rule("polar coordinates", "G16 and polar words are not followed.", "post in Cartesian coordinates"),
    "CC117": Rule("scaling or mirroring", "G51 is not followed.", "post at full scale, without mirroring"),
    "CC118": Rule("rotated coordinates", "G68 and rotated work offsets are not followed.", "post unrotated"),
    "CC119": Rule("splines", "Spline and NURBS moves are not followed.", "post lines and arcs"),
    "CC120": Rule(
        "spindle-synchronous motion",
        "Threading follows the spindle, not the feed.",
        "run the threading part without camcomp",
    ),
    "CC121": Rule(
        "probing",
        "Where a probing move ends is known at the machine only.",
        "take the probing out; camcomp needs to know where every move ends",
    ),
    "CC122": Rule(
        "turning",
        "Lathe modes are not followed: camcomp is for milling. On Sinumerik G70 and G71 are units.",
        "for units of Sinumerik, add --dialect sinumerik",
    ),
    "CC123": Rule(
        "expression or parameter",
        "A parameter is not set, an expression is malformed, or its value is known at the machine only.",
        "replace the expression by its value",
    ),
    "CC124": Rule(
        "jump, loop or call",
        "The statement that says where the program goes on is not complete, has no partner, or has a form that camcomp "
        "does not follow.",
    ),
    "CC125": Rule(
        "subprogram not there",
        "The program calls a subprogram that stands in another file, so what it moves is not known here.",
        "put the subprogram into the same file",
    ),
    "CC126": Rule(
        "program without end",
        "A hundred and fifty thousand blocks were executed by a program with loops or calls, or a hundred thousand without a "
        "motion, or calls are nested a hundred deep.",
        "check the condition of the loop",
    ),
    "CC127": Rule(
        "Heidenhain conversational",
        "Klartext programs have another language than ISO programs, and camcomp does not read it.",
        "post the program as DIN/ISO (.i), or for another control",
    ),
    "CC128": Rule("encoding", "The file is marked as UTF-16 and cannot be decoded.", "save it as UTF-8 or ASCII"),
    "CC129": Rule("offset statement", "The words of G10, G52 or G92 do not say which offset to set to what.", ""),
    "CC130": Rule(
        "G53 misused",
        "A move in machine coordinates is a straight one with absolute words.",
        "write G53 G0 or G53 G1 with absolute words",
    ),
    "CC131": Rule("dwell without a time", "G4 needs its time as P.", "write the time as P, e.g. G4 P0.5"),
    "CC132": Rule("canned cycle", "A word that the cycle needs is missing or makes no sense.", ""),
    "CC133": Rule("tool statement", "T, H, M6, M61 or G43 has a word that is missing or makes no sense.", ""),
    "CC134": Rule(
        "no motion code in force",
        "Axis words stand alone, and no G0 to G3 or cycle is in force (none yet, or G80 ended it).",
        "add G0 or G1",
    ),
    "CC135": Rule(
        "unknown statement",
        "A word of several letters is a statement of a control's own language that camcomp does not follow: it may "
        "move axes or coordinates.",
        "check the dialect (--dialect, or control: dialect: in the YAML)",
    ),
    "CC136": Rule(
        "several main programs",
        "The file holds more than one program that ends by itself. Only the first is executed, so the others would "
        "stay as they are without a word.",
        "one file per program",
    ),
    "CC137": Rule(
        "line cannot be rewritten",
        "The line does too much at once for its motion to be replaced: it changes a mode and stops the program in the "
        "same block, it taps, or it stores the position where the tool stands.",
    ),
    "CC138": Rule(
        "value out of range",
        "The number is not finite, negative where it must not be, or too large.",
        "check the number and the units (G20, G21)",
    ),
    "CC139": Rule(
        "comma",
        "Behind a comma, controls expect a corner radius or a chamfer, which changes the geometry; and some people "
        "write decimal commas.",
        "post corners as arcs and lines",
    ),
    "CC140": Rule(
        "line too long",
        "No control reads a line of more than some hundred characters; one of 16 384 is no NC program, or has lost its ends "
        "of line.",
        "is this the right file?",
    ),
    "CC141": Rule(
        "no NC program",
        "Hardly a line of the file has the form of an NC program. Its text is not shown, because it may be "
        "confidential.",
        "is this the right file? YAML files have to end in .yaml or .yml",
    ),
    "CC142": Rule(
        "rapid through material",
        "By the stock of the machine file a rapid leads the tool through material that has not been cut away by then: on the "
        "machine that is a crash. Rapids are taken to be straight.",
        "retract before the rapid, or correct workpiece: stock",
    ),
    "CC143": Rule(
        "stock in comments not usable",
        "The comments of the program are to state the stock (`--stock comments`, or `workpiece: {stock: {type: comments}}`), "
        "and none does, or what they state leaves its form or its place open.",
        "state workpiece: stock in the machine file, or use --stock program",
    ),
    "CC144": Rule(
        "robot statement not followed",
        "A program in the language of a robot (KRL, RAPID, Fanuc LS) is read as one module that runs from its first line to its "
        "last, with poses written as numbers. Control flow, variables, relative moves and unknown statements are refused.",
        "post plain moves with numbers",
    ),
    "CC145": Rule(
        "robot frame or tool",
        "A base or tool of a robot program is not stated as numbers, is not in the machine file, or contradicts it.",
        "state control: base_frames, tool_frames and flange_abc_deg, and section tool, as they are in the control",
    ),
    "CC146": Rule(
        "moves pass uncorrected",
        "A warning. Feed moves before X, Y and Z have all been commanded, in machine coordinates (G53 G1), from a place that a "
        "robot program does not state, or behind the end of the program stay as they are. So do all moves where every correction "
        "is below the step of the output.",
        "begin with a rapid that names X, Y and Z (control: start_mm if the machine stands elsewhere)",
    ),
    "CC147": Rule(
        "unit in a comment only",
        "A comment says that lengths are in inch, and the program has no G20 or G70: without a unit code lengths are read in mm, "
        "25.4 times too small. Some posts leave the unit to a setting of the controller.",
        "write G20 before the first move, or state control: {program_unit: inch} or mm in the machine file",
    ),
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
    "CC204": Rule("wrong type", "The value has another type than the key asks for, e.g. a word where a number is due."),
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
    "CC209": Rule("limits in wrong order", "The lower limit has to be below the upper one.", "write [low, high]"),
    "CC210": Rule(
        "tab in the indentation",
        "YAML forbids tabs in indentation, because their width is not defined.",
        "replace tabs by spaces",
    ),
    "CC211": Rule("empty file", "The file has no content but perhaps comments.", "`camcomp init DIR` writes a start"),
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
    "CC216": Rule(
        "optional part missing",
        "What is asked for needs a package that a plain installation leaves out because it is large.",
        "pip install 'camcomp[report]'",
    ),
    "CC217": Rule(
        "YAML beyond the budget",
        "A machine file has some hundred values. More than a megabyte, 20 000 values (an alias counts wherever it is used) "
        "or 50 levels are a mistake, or meant to stop the reader.",
        "tables belong into CSV files",
    ),
    "CC218": Rule(
        "no file of camcomp",
        "None of the sections of a machine file or of an experiment stands in the file. Its text is not shown, because it may "
        "be confidential.",
        "check the path; `camcomp init DIR` writes a machine file",
    ),
    "CC219": Rule(
        "machine not shipped",
        "`camcomp init --machine` starts from a machine file that camcomp brings along; this name is none of them.",
        "`camcomp init --list` names them",
    ),
    "CC240": Rule(
        "robot description not usable",
        "A URDF describes a tree of links. camcomp takes one chain of hinges and slides from it, with masses and centres; "
        "macros, coupled and floating joints and closed chains it does not take.",
        "write the chain by hand; camcomp init shows the keys",
    ),
    "CC250": Rule(
        "spindle speed missing",
        "Milling force models need the feed per tooth, which is feed over teeth and spindle speed; a speed of zero "
        "means that nothing turns while the tool cuts.",
        "give S in the program, or add process: spindle_rpm",
    ),
    "CC251": Rule(
        "number of teeth missing",
        "Milling force models need the feed per tooth, which is feed over teeth and spindle speed.",
        "add tool: teeth",
    ),
    "CC252": Rule(
        "feed missing",
        "A point at which the tool cuts has no feed above zero, so the chip has no thickness.",
        "give F in the program, or add process: feed_mm_per_min",
    ),
    "CC253": Rule(
        "axial depth missing",
        "Milling forces grow with the axial depth of the cut. It is either a constant, or the depth of the programmed "
        "point below the top of the stock.",
        "add process: depth_mm, or workpiece: stock_top_mm",
    ),
    "CC254": Rule(
        "tool diameter missing",
        "Over which part of its turn a tooth cuts follows from radial width and tool diameter.",
        "add tool: diameter_mm",
    ),
    "CC255": Rule(
        "radial width not possible",
        "The radial width of a cut lies between zero and the tool diameter; without it a slot is assumed.",
        "correct process: width_mm or tool: diameter_mm",
    ),
    "CC256": Rule(
        "up or down milling not said",
        "A cut on one side of the tool pushes it differently in up (conventional) and in down (climb) milling.",
        "add process: force: milling: up, or down",
    ),
    "CC257": Rule(
        "force ratio missing",
        "Kienzle's law gives the tangential force only. The radial and the axial force follow by ratios that depend on "
        "tool, material and wear; there is no value that would be right in general.",
        "measure one slot and divide: radial = force against the feed over force square to it",
    ),
    "CC258": Rule(
        "sense of rotation contradicts the program",
        "M3 and M4 say how the spindle turns, and a side force turns over with it. The machine file may say it for programs "
        "that do not; it may not say something else.",
        "take process: force: spindle out, or correct the program",
    ),
    "CC260": Rule(
        "force table empty",
        "A force table is CSV text: one header row, then rows of plain numbers.",
        "columns: s_mm or line, and Fr_N,Ft_N,Fz_N or fx_N,fy_N,fz_N",
    ),
    "CC261": Rule(
        "column missing in the force table",
        "A force table says where (s_mm or line) and how strong (all three forces, in one of the two frames).",
        "columns: s_mm or line, and Fr_N,Ft_N,Fz_N (path frame) or fx_N,fy_N,fz_N (machine frame)",
    ),
    "CC262": Rule(
        "no number in the force table",
        "A row that gives a force gives all three, and the place.",
        "fill the cell, or leave all three forces of the row empty",
    ),
    "CC263": Rule(
        "force table out of order",
        "Rows with s_mm follow the path. A repeated s_mm is allowed and marks a jump of the force.",
        "sort the rows by s_mm",
    ),
    "CC264": Rule(
        "point outside the force table",
        "The program cuts at a point that the table does not cover; a force is not extrapolated.",
        "extend the table; a row of zeros says that there is no force",
    ),
    "CC265": Rule(
        "coefficients cannot be fitted",
        "The fit draws a straight line through mean slot forces at two or more feeds per tooth.",
        "measure slots at three or more feeds, everything else unchanged",
    ),
    "CC266": Rule(
        "error table not readable",
        "An error table is CSV text with a column position_mm that rises and the errors there: error_um, or forward_um and "
        "reverse_um (mm, um, rad, mrad, urad). LinuxCNC's screw file has three numbers per line.",
        "a screw file needs comp_type: 0 or 1 beside it, as COMP_FILE_TYPE says",
    ),
    "CC270": Rule(
        "set-point not readable",
        "A line of `camcomp stream` is a JSON object or CSV: x_mm, y_mm, z_mm, fx_N, fy_N, fz_N and, if wanted, t_s.",
    ),
    "CC271": Rule(
        "no program found",
        "None of the paths, folders and patterns names an NC program.",
        "programs end in .nc, .ngc, .tap, .gcode, .cnc, .mpf, .spf, .src, .mod, .prg, .ls, .ncc, .eia, .min or .iso, or are named one by one",
    ),
    "CC280": Rule(
        "plug-in not usable",
        "What the entry point of a robot, dialect, force model or effect names cannot be imported or does not keep to its "
        "contract: the names that have to be there, hooks and their arguments, values that are allowed, and nothing "
        "changed at nominal parameters. The contracts stand in camcomp/plugins. Runs that do not name it go on without it.",
        "mend it, or uninstall its package",
    ),
    "CC281": Rule(
        "plug-in failed",
        "A function of the user's plug-in raised an error in the middle of the work, or returned what it must not: "
        "another shape than it was given, or a value that is no number where all that it was given were numbers.",
        "CAMCOMP_DEBUG=1 shows the traceback; `diagnose --without NAME` leaves an effect out",
    ),
    "CC284": Rule(
        "number cannot be uncertain",
        "Numbers of robot, workpiece, tool, process and effects may be written `{value, sd}`, or `{low, high}` for a 95 % "
        "interval. What the control and the compensation are told is known, and a count, such as the teeth of a tool, has no "
        "deviation.",
        "write the value alone, or a smaller sd",
    ),
    "CC290": Rule(
        "formula not readable",
        "The formula of a law is made of numbers, + - * / ^, brackets, a few functions and the covariates that are known where "
        "it acts; their names end in their units. Nothing else can be said in it.",
        "docs/reference/library.md lists functions and covariates",
    ),
    "CC291": Rule(
        "map not usable",
        "A map is a grid of coefficients over one or two covariates, and its envelope says over which range.",
        "write the map as `camcomp diagnose --write-config` does",
    ),
    "CC292": Rule(
        "learned law not usable",
        "A file law_*.json in the folder of --library is not what `camcomp diagnose --library` writes there.",
        "delete the file, or restore it",
    ),
    "CC295": Rule(
        "tool without a diameter",
        "What a tool cuts of a stock depends on its diameter and form.",
        "add tool: diameter_mm, or tools: {1: {diameter_mm: ...}} for the tool of that T number",
    ),
    "CC296": Rule(
        "tool in no one direction",
        "The stock is kept as heights along one direction, from which the tool may lean by 5 degrees during cuts.",
        "take workpiece: stock out for this program, or correct every operation in a program of its own",
    ),
    "CC297": Rule(
        "stock file not usable",
        "A stock from a file is an STL with at least one body, closed, in mm in the program frame.",
        "check the path, close what is open in a mesh repair, or export the file anew",
    ),
    "CC298": Rule(
        "stock never touched",
        "No motion of the program takes anything off the stock, so the stock lies elsewhere or the program is another one.",
        "the stock is given in mm in the program frame of G54: check its place, the unit of an STL file, and the zero of the program",
    ),
    "CC299": Rule(
        "tool table not usable",
        "`tools: {file: ...}` names the tool table of a control or a CAM system: LinuxCNC (.tbl), FreeCAD (.fctl, .fctb), CSV "
        "(.csv). It is not one of these, or a line of it cannot be read.",
        "docs/how-to/stock.md shows the files that are read",
    ),
    # --- CC3xx physics -----------------------------------------------------------------------------------------
    "CC301": Rule(
        "no convergence",
        "The loaded equilibrium was not found: the load is too large for the machine at this point, or the model is "
        "close to a limit.",
        "check the force and the stiffness values; look at the point with a smaller force",
    ),
    "CC302": Rule(
        "out of reach",
        "The rigid machine cannot bring its platform to this point: a leg is too short, or the point lies outside the "
        "workspace.",
        "check the workpiece origin, the units of the program (G20/G21) and the tool length",
    ),
    "CC303": Rule(
        "singular configuration",
        "Some motion of the platform or of a leg costs no force here, or the drives cannot move the platform; the "
        "stiffness model has no answer.",
        "move the workpiece away from the singular configuration, or remove an idle joint from the chain",
    ),
    "CC304": Rule(
        "not stable",
        "Under this load the elastic machine would buckle: the equilibrium exists, but it is not stable.",
        "reduce the load, or check the stiffness values",
    ),
    "CC305": Rule(
        "branch changes",
        "An arm reaches most points in several postures. It keeps that of the start pose; between two end points of "
        "the program the joints would have to change over to another one.",
        "choose start angles nearer to the work, move the workpiece, or turn the tool about its axis (tool.turn_deg)",
    ),
    "CC306": Rule(
        "result not finite",
        "The model answered with NaN or infinity. An effect, a force model or a value of the machine file leads out of what "
        "can be computed; no file is written, because means and maxima would hide such a number.",
        "look at the plug-ins and effects named, and at values far from those of real machines",
    ),
    # --- CC4xx logs, experiments -------------------------------------------------------------------------------
    "CC400": Rule(
        "log without rows",
        "The log is no table with a header and at least one row.",
        "write a CSV file with one header row",
    ),
    "CC401": Rule(
        "column missing in a log",
        "A log needs `t_s`, and a column with another name is not read.",
        "name the columns as docs/reference/log-columns.md does: t_s, line, x_mm, cmd_x_mm, act_x_mm, act_x_N, fx_N, temp_C",
    ),
    "CC402": Rule(
        "run without program",
        "A run may lack its program only where the log has set-points, or actuator coordinates with the measured tip.",
        "name the program of the run, or log cmd_<actuator>_mm",
    ),
    "CC403": Rule("cell of a log", "A cell of a log is a number or empty.", "correct the cell, or leave it empty"),
    "CC404": Rule(
        "log measures nothing",
        "At least one of the channels tip, encoders, drive forces and dynamometer has to hold numbers.",
        "check the names of the columns; `camcomp import` takes other names and units",
    ),
    "CC405": Rule(
        "time runs backward",
        "Rows of a log follow each other in time. Rows of equal time, or two runs in one file, cannot be put in order.",
        "one file per run, one row per sample",
    ),
    "CC406": Rule(
        "log of another program",
        "The log's source lines or places are not those of the program that the run names.",
        "check program and log of the run, and the workpiece origin of the config",
    ),
    "CC407": Rule(
        "log in another unit",
        "The values fit the program when they are read in another unit. A unit is never guessed silently.",
        "convert the column to the unit that its name ends in",
    ),
    "CC408": Rule(
        "axes of a log swapped",
        "The values fit the program when columns are exchanged or change sign.",
        "correct the header, or the sign, of the log",
    ),
    "CC409": Rule(
        "log too short",
        "A run of a program has at least twelve rows; fewer do not determine their noise.",
        "log the whole run, some hundred rows",
    ),
    "CC410": Rule(
        "measured point out of reach",
        "The control could not have gone where the run says: the model and the logs do not belong together.",
        "check the config of the experiment, the workpiece origin and the units of the log",
    ),
    "CC411": Rule(
        "run cannot be simulated",
        "The loaded equilibrium of the model was not found at a point of the run.",
        "check the force and stiffness values of the config",
    ),
    "CC412": Rule(
        "joints and tips of different rows",
        "The tips of static poses fit the joint angles of the row before or behind. Read as they are, every pose would be "
        "as wrong as the arm is large, and effects would be fitted to that.",
        "write the joints and the tip of one pose into one row",
    ),
    "CC413": Rule(
        "poses of another machine",
        "With the best frames, the tips are further from the arm of the config than any arm of the kind is wrong, in no "
        "other unit, order or sign of the columns they would fit, and neither bending of the arm nor of its base under weight "
        "explains most of it. A diagnosis would be one of the mistake.",
        "check the config of the experiment, and which column is which joint",
    ),
    # --- CC5xx input and output --------------------------------------------------------------------------------
    "CC420": Rule(
        "too little to study",
        "Logs without a program are studied as static poses of an arm (joint angles and measured tips) or as axes "
        "(set-points or drive forces with encoders, at least 50 rows in which the axis moves). The message says which columns "
        "and how many rows each run has.",
        "docs/reference/log-columns.md lists the columns of a log",
    ),
    "CC421": Rule(
        "column not found",
        "A column that the log needs has no counterpart in the table under any usual name.",
        "name it with --column",
    ),
    "CC422": Rule(
        "cell is not a number",
        "Cells of a table are numbers or empty.",
        "delete units and words; write dates as 2022-10-11 or 11.10.2022",
    ),
    "CC423": Rule(
        "axis of a recording",
        "A MATLAB file of one axis, with t in s, qg and qm in m and, for forces, vir and gtau, belongs to an axis of the machine.",
        "--actuator names one of the machine's",
    ),
    "CC424": Rule(
        "name of a run",
        "Runs are called by their files, without folder and suffix, with a number behind where that is there twice.",
        "the runs are listed",
    ),
    "CC425": Rule(
        "table too long",
        "A log or another table has more rows than memory and patience should be spent on.",
        "log less often, or cut the run into several; check the feed, the acceleration and --step-s",
    ),
    "CC450": Rule(
        "table not readable",
        "A CSV table has one row of column names and then rows of numbers; cells may be empty.",
        "decimal points, commas between cells",
    ),
    "CC451": Rule(
        "tables cannot be compared",
        "Two tables are compared where they have columns in common and a common way to find the place: path length and "
        "source line, time, or the number of the row.",
        "choose another --by",
    ),
    "CC452": Rule(
        "recording cannot be read",
        "The file is not what its name or its first bytes say, is damaged, holds no numbers, or is of a kind that nothing "
        "well kept reads.",
        "export it as CSV",
    ),
    "CC453": Rule(
        "files of one run cannot be joined",
        "Files of one run are joined row by row where they have equally many rows, else on a time that they have in common.",
        "cut both to the same rows, or bring their times to one clock",
    ),
    "CC454": Rule(
        "no kept diagnosis",
        "The folder of a machine's history holds results of camcomp diagnose, each in a file that camcomp history --add has "
        "written, with the day of its runs.",
        "write the result with `camcomp diagnose EXPERIMENT --json RESULT.json`, then `camcomp history DIR --add RESULT.json`",
    ),
    "CC455": Rule(
        "diagnosis kept already",
        "The same result stands in the folder already; counted twice it would look like two measurements that agree.",
        "nothing is to be done",
    ),
    "CC500": Rule("file cannot be read", "The file is not there, or may not be read.", "check the path"),
    "CC501": Rule(
        "file cannot be written",
        "The folder is not there, is full, or may not be written to.",
        "check the folder, its rights and the space on the disk",
    ),
    "CC502": Rule(
        "output is the input",
        "An output names a file that is being read, or the file of another output, perhaps through a link. An input is "
        "never overwritten.",
        "choose another name for the output",
    ),
    "CC503": Rule("input or output failed", "The operating system refused a file or stream.", "check disk and rights"),
    "CC504": Rule(
        "output folder in use",
        "Another batch is writing into this folder. Two at once would mix their programs.",
        "wait for the other, or choose another folder",
    ),
    "CC505": Rule(
        "workers do not fit",
        "A worker of the Dask cluster has no camcomp, or another version of it, and would make other programs.",
        "install the same version of camcomp on all workers",
    ),
    # --- CC6xx checks ------------------------------------------------------------------------------------------
    "CC601": Rule(
        "residual over tolerance",
        "The corrected program, as written, leaves more of the tip error than the tolerance allows.",
        "raise --tolerance-um, or give the control a finer control.resolution_mm",
    ),
    "CC602": Rule(
        "travel limit",
        "An actuator would have to leave the travel that the machine file states.",
        "move the workpiece (workpiece.origin_mm)",
    ),
    "CC603": Rule(
        "already compensated",
        "The program carries the stamp of camcomp. A second compensation would apply the correction twice.",
        "compensate the original program",
    ),
    "CC604": Rule(
        "not a correction of this program",
        "The moves of the program could not be matched to those of the original, so there is nothing to compare.",
        "name the original from which the program was made",
    ),
    "CC605": Rule(
        "set-points in error",
        "Some lines of the stream could not be read or solved, or lead an actuator out of its travel. Their answers say "
        "why.",
    ),
    "CC606": Rule(
        "tables differ",
        "Somewhere a column differs by more than the --tolerance that was asked for.",
        "the output of compare says where",
    ),
    "CC607": Rule(
        "interpolation",
        "Long programs are corrected by interpolation between exact solutions. Points of it, solved exactly at the end, "
        "differ by more than they may; the outputs stand, and are not to be used. Programs of up to 1 MB are solved point by "
        "point then.",
        "cut the program into parts of less than 1 MB, and report the case",
    ),
    "CC608": Rule(
        "no program for a next experiment",
        "A program is proposed where causes are left to separate, the runs had programs, and the machine reaches the experiment "
        "from above within the travel of its actuators.",
        "next_experiment of the result says what would help, if anything",
    ),
    "CC609": Rule(
        "worse than the original",
        "By the model the corrected program has a larger error at its worst point than the original one.",
        "use the original program, or a smaller --tolerance-um; the machine file may describe a machine that needs no "
        "correction here",
    ),
    "CC610": Rule(
        "no place for the program",
        "At every place of the table that was tried the machine cannot reach a point of the program, or leaves its travel.",
        "give the table as --x-mm and --y-mm, and its height as workpiece: origin_mm",
    ),
}
