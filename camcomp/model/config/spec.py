"""YAML specs of the sections of a machine file, and of an experiment file."""

from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, PrivateAttr, model_validator
from pydantic_core import PydanticCustomError

from camcomp.gcode.path_mode import PATTERN
from camcomp.ground.errors import Location
from camcomp.model.config.base import NotNegative, Positive, Spec, Vector, exactly_one, zero
from camcomp.model.config.cutting_tool import Cutter, NumberedCutter, Stock
from camcomp.model.config.doubt import Doubt
from camcomp.model.config.robot import RobotSpec
from camcomp.model.config.spread import Spread
from camcomp.model.config.yaml_tree import Node, find

WorkOffset = Annotated[str, Field(pattern=r"^G5([5-9]|9\.[123])$")]
ToolNumber = Annotated[int, Field(ge=0)]
NotEmpty = Annotated[str, Field(min_length=1)]


class Workpiece(Spec):
    """Position of G54 in the machine frame, and the stock."""

    origin_mm: Vector = zero("origin of G54 in the machine frame")
    rotation_deg: float | None = Field(None, description="about the tool axis (machine z)")
    rotation_vector_deg: Vector | None = Field(None, description="rotation vector in machine axes")
    stock_top_mm: float | None = Field(
        None, description="height in the program frame; feed moves at or above it cut air"
    )
    stock: Stock | None = Field(
        None, description="what the tool begins with: where and how deep it cuts then follows from what still stands"
    )

    @model_validator(mode="after")
    def _one_rotation(self) -> "Workpiece":
        if self.rotation_deg is not None or self.rotation_vector_deg is not None:
            exactly_one(self, "rotation_deg", "rotation_vector_deg")
        return self

    @property
    def rotation(self) -> list[float]:
        """Rotation vector (3,) in degrees, program frame against machine frame."""
        return self.rotation_vector_deg or [0.0, 0.0, self.rotation_deg or 0.0]


class Tool(Cutter):
    """The tool in the spindle."""

    length_mm: NotNegative | None = Field(None, description="along platform -z, from its reference point to the tip")
    vector_mm: Vector | None = Field(None, description="from the tip to the platform reference point, in platform axes")
    turn_deg: float | None = Field(
        None,
        description="of the platform's x axis from program X about the tool axis, for machines with six actuators; "
        "default: what is nearest to the start pose",
    )

    @model_validator(mode="after")
    def _one_length(self) -> "Tool":
        if self.length_mm is not None and self.vector_mm is not None:
            exactly_one(self, "length_mm", "vector_mm")
        return self

    @property
    def tip(self) -> list[float]:
        """Tip (3,) mm seen from the platform reference point, in platform axes."""
        if self.vector_mm is not None:
            return [-value for value in self.vector_mm]
        return [0.0, 0.0, -(self.length_mm or 0.0)]


class Choice(Spec):
    """A plug-in chosen by name, with its own parameters as further keys.

    `given`: these parameters as written; `params`: checked and completed by the plug-in's own spec.
    """

    model_config = ConfigDict(extra="allow")

    _params: Any = PrivateAttr(None)

    @property
    def given(self) -> dict[str, Any]:
        """The plug-in's own keys."""
        return dict(self.model_extra or {})

    @property
    def params(self) -> Any:
        """Instance of the plug-in's Params."""
        return self._params


class ForceChoice(Choice):
    """Cutting-force model, a member of the shelf `forces`."""

    model: str = Field(description="name of the force model")


class EffectChoice(Choice):
    """One difference between the machine and its ideal model, a member of the shelf `effects`; target = actuator, or none."""

    effect: str = Field(description="name of the effect")
    target: str | None = Field(None, description="actuator on which it acts; none where it concerns the machine")

    @property
    def values(self) -> dict[str, Any]:
        """All parameters of the effect by name; those missing in the file have their nominal values."""
        if hasattr(self.params, "effect_values"):  # of parameters that are more than numbers
            return dict(self.params.effect_values())
        out: dict[str, Any] = self.params.model_dump(exclude={"source"})
        return out


class Process(Spec):
    """The cut."""

    force: ForceChoice = Field(
        default_factory=lambda: ForceChoice(model="none"), description="cutting-force model with its parameters"
    )
    spindle_rpm: Positive | None = Field(None, description="used where the program has no S")
    feed_mm_per_min: Positive | None = Field(None, description="used where the program has no F")
    depth_mm: Positive | None = Field(None, description="axial depth of cut")
    width_mm: Positive | None = Field(None, description="radial width of cut")
    temperature_C: float | None = Field(
        None, description="of the drives during the cut; without it they warm up from 20 when the program starts"
    )


class RobotFrame(Spec):
    """A base in the machine frame, or a tool in the control's flange frame."""

    origin_mm: Vector = zero("of the frame")
    abc_deg: Vector = Field([0.0, 0.0, 0.0], description="R = Rz(A) Ry(B) Rx(C); Fanuc has them as R, P, W")


class Control(Spec):
    """The controller: settings that the program text does not contain."""

    resolution_mm: Annotated[float, Field(ge=1e-9)] = Field(
        0.001, description="smallest step of a number in the corrected program; sets its decimals"
    )
    start_mm: Vector = Field(
        default_factory=lambda: [0.0, 0.0, 0.0],
        examples=[[0, 0, 50]],
        description="position of the tip before the first motion, program frame",
    )
    dialect: str | None = Field(None, description="member of the shelf dialects; default: found from the text")
    offsets_mm: dict[WorkOffset, Vector] = Field(
        default_factory=dict,
        description="origins of G55 to G59.3 in the machine frame, e.g. G55: [100, 0, 0]; that of G54 is "
        "workpiece.origin_mm",
    )
    tool_number: ToolNumber = Field(0, description="tool in the spindle when the program starts")
    tool_lengths_mm: dict[ToolNumber, float] = Field(
        default_factory=dict, description="length offsets of G43 by tool number"
    )
    reference_positions_mm: dict[Literal["G28", "G30"], Vector] = Field(
        default_factory=dict, description="machine coordinates to which G28 and G30 go"
    )
    table_axes: list[Literal["A", "B", "C"]] = Field(
        default_factory=list,
        description="rotary axes that turn the workpiece between cuts: lines that move nothing else pass unchanged",
    )
    orientation_words: Literal["ABC"] | None = Field(
        None,
        description="machines with six actuators: A, B, C are written into programs that do not state the tool's orientation, "
        "so that it is corrected too",
    )
    absolute_accuracy: bool | None = Field(
        None,
        description="the control corrects the arm's geometry itself (KUKA absolutely accurate, ABB Absolute Accuracy); then only "
        "compliance is compensated. To be stated for robot programs",
    )
    base_frames: dict[ToolNumber, RobotFrame] = Field(
        default_factory=dict, description="BASE_DATA[n], UFRAME n of the control, in the machine frame"
    )
    tool_frames: dict[ToolNumber, RobotFrame] = Field(
        default_factory=dict, description="TOOL_DATA[n], UTOOL n of the control, in its flange frame"
    )
    flange_abc_deg: Vector = Field(
        [0.0, 180.0, 0.0],
        description="axes of the control's flange frame in those of the platform: R = Rz(A) Ry(B) Rx(C)",
    )
    block_delete: bool = Field(False, description="the switch is on: lines that start with / are not executed")
    input_increment_mm: Positive | None = Field(
        None,
        description="worth of one unit in a number without decimal point (Fanuc IS-B: 0.001); missing = a number is in mm",
    )
    program_unit: Literal["mm", "inch"] | None = Field(
        None, description="of lengths and feeds before the first G20 or G21 of a program; default: mm"
    )
    acceleration_mm_per_s2: Positive = Field(1500.0, description="largest of every axis")
    velocity_mm_per_s: Positive | None = Field(None, description="largest of every axis; default: feeds as programmed")
    path_mode: Annotated[str, Field(pattern=PATTERN)] | None = Field(
        None,
        description="in force until the program says another one: G61, G61.1, G64, G64 P0.01, G64 P0.01 Q0 (mm); "
        "default: G64 is assumed",
    )
    block_time_s: Positive = Field(0.001, description="least time that the control takes for a move")
    look_ahead_blocks: Annotated[int, Field(ge=1)] = Field(50, description="moves that it knows when it sets the speed")
    tool_change_s: Annotated[float, Field(ge=0.0)] = Field(0.0, description="that an M6 takes, for the cycle time")


class Compensation(Spec):
    """How the correction is found."""

    method: Literal["newton", "stiffness", "fixed-point", "linear"] = Field(
        "newton",
        description="newton: eq. (3), stiffness: eq. (4), fixed-point: eq. (5), linear: Cartesian compliance as baseline",
    )
    tolerance_um: Annotated[float, Field(ge=1e-6)] = Field(
        1.0, description="largest distance between the corrected path and the exact correction"
    )
    arcs: bool | None = Field(
        None,
        description="programmed arcs come out as arcs (G2, G3) where those are fewer than straight lines; default: where "
        "the path mode of the program, or control.path_mode, makes them faster or more accurate",
    )
    policy: Literal["full", "shrink", "skip"] = Field(
        "full",
        description="what uncertain numbers do to the correction: nothing; the share of it that is expected to leave least, and "
        "that harms hardly any machine; lines stay as programmed where the band exceeds the gain",
    )


class Config(Spec):
    """All sections of a machine file; several files make one Config, later keys win."""

    robot: RobotSpec = Field(description="chains of joints and links, or a kind of robot with its parameters")
    workpiece: Workpiece = Field(
        default_factory=lambda: Workpiece(), description="where the workpiece lies, and its stock"
    )
    tool: Tool = Field(default_factory=lambda: Tool(), description="the tool in the spindle")
    tools: dict[ToolNumber, NumberedCutter] = Field(
        default_factory=dict, description="cutting parts by T number; other tools are as in the section tool"
    )
    process: Process = Field(default_factory=lambda: Process(), description="cutting force and cutting conditions")
    control: Control = Field(default_factory=lambda: Control(), description="what the NC control does")
    compensation: Compensation = Field(
        default_factory=lambda: Compensation(), description="how the correction is found"
    )
    effects: list[EffectChoice] = Field(
        default_factory=list, description="ways in which the real machine differs from the ideal one"
    )

    _tree: Node | None = PrivateAttr(None)
    _read_tree: Callable[[], tuple[Node | None, Any]] | None = PrivateAttr(None)  # of a kept one, when it is asked for
    _spreads: tuple[Spread, ...] = PrivateAttr(())
    _doubts: tuple[Doubt, ...] = PrivateAttr(())

    @property
    def spreads(self) -> tuple[Spread, ...]:
        """The uncertain numbers; all other readers of the config see their values."""
        return self._spreads

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Contradictions and gaps of the tool tables of the file."""
        return self._doubts

    @property
    def uncertain(self) -> bool:
        """Whether a number has a positive standard deviation."""
        return any(each.sd > 0.0 for each in self._spreads)

    @property
    def tree(self) -> Node | None:
        """The values as they were written, with their locations."""
        if self._tree is None and self._read_tree is not None:
            self._tree = self._read_tree()[0]
        return self._tree

    def at(self, *keys: str | int) -> Location | None:
        """Where the value under these keys was written; the nearest mapping above it when it is a default."""
        return find(self.tree, keys).at if self.tree is not None else None


class RunSpec(Spec):
    """One run of an experiment: program, log, and conditions shared with other runs (clamping, clock)."""

    name: NotEmpty = Field(description="name of the run, in results and for holdout")
    program: NotEmpty | None = Field(
        None, description="NC program that was run; none where set-points or poses are logged"
    )
    log: NotEmpty = Field(description="CSV of what was measured")
    cutting: bool = Field(description="whether the tool cut")
    started_s: float = Field(0.0, description="start of the run on the common clock of all runs")
    clamping: str | int | None = Field(None, description="label of the clamping; default: one for all runs")
    clock: str | int | None = Field(
        None, description="label of the clock between tip and controller; default: one for all runs"
    )


class Deviations(Spec):
    """Standard deviations of the instruments over a run, per axis, drift and their own frame included."""

    tip_mm: Positive | None = Field(None, description="of the measured tip")
    encoder_mm: Positive | None = Field(None, description="of the encoders of slides")
    encoder_rad: Positive | None = Field(None, description="of the encoders of hinges")
    force_N: Positive | None = Field(None, description="of measured forces")
    force_Nmm: Positive | None = Field(None, description="of measured torques")


class Experiment(Spec):
    """An experiment file; paths are relative to it as written and absolute once loaded."""

    config: Annotated[list[NotEmpty], Field(min_length=1)] = Field(
        description="machine files of the model under judgement, later ones over earlier ones"
    )
    runs: Annotated[list[RunSpec], Field(min_length=1)] = Field(description="the runs that were logged")
    holdout: list[str] = Field(
        default_factory=list,
        description="names of the runs that are withheld from the fit; default: chosen by the tool",
    )
    sd: Deviations | None = Field(None, description="standard deviations of the instruments")

    @model_validator(mode="after")
    def _names(self) -> "Experiment":
        names = [run.name for run in self.runs]
        for name in names:
            if names.count(name) > 1:
                raise PydanticCustomError("CC205", f"two runs are called '{name}'")
        for name in self.holdout:
            if name not in names:
                raise PydanticCustomError("CC205", f"holdout names '{name}', and there is no such run")
        return self
