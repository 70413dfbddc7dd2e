"""YAML files to checked specs and plug-ins. Every mistake of every file is reported at once."""

import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, create_model

from camcomp.ground import shelf
from camcomp.ground.errors import CamcompError, ConfigError, FileError, Location, raise_all
from camcomp.ground.files import display_name, read_bytes
from camcomp.ground.records import dataclass, replace
from camcomp.model.config import linuxcnc_ini
from camcomp.model.config.base import Spec
from camcomp.model.config.effect_entries import key_of_effect, merged_entries
from camcomp.model.config.kept import KeptConfig, Texts
from camcomp.model.config.robot import RevoluteActuator, RobotSpec
from camcomp.model.config.spec import Config, EffectChoice, Experiment
from camcomp.model.config.spread import Spread, UncertainInput, replaced, without_spreads
from camcomp.model.config.stated import in_stated_dialect
from camcomp.model.config.tool_table import with_tool_tables
from camcomp.model.config.yaml_check import check, choose
from camcomp.model.config.yaml_tree import Node, merge, plain, tree_of

ROBOT_KEYS = ("name", "source", "start_reference_mm")  # belong to the robot, whatever plug-in builds its chains

_SECTIONS = tuple(key for spec in (Config, Experiment) for key in spec.yaml_keys() if key != "source")
_SECTION = rb"(?m)(^|[{,])[ \t\"']*(%s)[\"']?[ \t]*:([ \t\r\n]|$)" % "|".join(_SECTIONS).encode()
_NO_FORCE = Node({"model": Node("none", Location("", 1, 1))}, Location("", 1, 1))


def load_config(paths: Sequence[Path | str]) -> Config:
    """Load one configuration from `paths`: later files over earlier ones, key by key.

    Raises:
        ConfigError: exit code 2, one entry per error of any file.
        FileError: exit code 5, a file cannot be read.
    """
    texts, errors = _read_texts(paths)
    kept = KeptConfig(texts)
    config = None if errors else kept.load()
    if config is None:
        tree, config = _checked_config(texts, errors)
        kept.save(tree, config)
    else:
        config._read_tree = partial(_merged_texts, texts)
    return in_stated_dialect(config)


def _checked_config(texts: Texts, errors: list[CamcompError]) -> tuple[Node, Config]:
    """The tree of machine files and its configuration. errors: of files that cannot be read."""
    tree, more = _merged_texts(texts)
    errors = [*errors, *more]
    if tree is None:
        _raise(errors)
        raise ConfigError("CC212", "no configuration is given", hint="name one with --config FILE")
    if _get(tree, "robot") is None:
        errors.append(ConfigError("CC212", "there is no section 'robot'", at=tree.at))
    _, config, more = _checked(tree)
    _raise([*errors, *more])
    assert config is not None
    return tree, config


def check_config(paths: Sequence[Path | str]) -> Config | None:
    """Check `paths`, complete or not, including the files of the force model; return a complete configuration.

    Files without the name of a robot are overrides of another machine file, in which any key may be missing. Raises as
    load_config.
    """
    tree, errors = _read_merged(paths)
    tree, config, more = (None, None, []) if tree is None else _checked(tree)
    if _get(tree, "robot", "name") is None:
        more = [each for each in more if each.rule != "CC203"]
    _raise([*errors, *more, *_force_files(_get(tree, "process", "force"))])
    return None if config is None else in_stated_dialect(config)


def _force_files(node: Node | None) -> list[CamcompError]:
    """Errors in the files of a force model, found by the model's function `check`."""
    params, _ = _plugin("forces", "model", node)
    if node is None or params is None:
        return []
    look = getattr(shelf.load("forces", node.value["model"].value), "check", None)
    try:
        if look is not None:
            look(params)
    except CamcompError as error:
        error.at = error.at or node.at
        return [error]
    return []


@dataclass(frozen=True, eq=False)
class ExperimentFile:
    """An experiment file and the configuration of its machine files, each read once. path: as given."""

    path: str
    experiment: Experiment
    config: Config


def read_experiment(file: Path | str | ExperimentFile) -> ExperimentFile:
    """An experiment file with its machine files; one that was read before is returned. Raises as load_config."""
    if isinstance(file, ExperimentFile):
        return file
    experiment = load_experiment(file)
    return ExperimentFile(str(file), experiment, load_config(experiment.config))


def load_experiment(path: Path | str) -> Experiment:
    """An experiment file, its paths resolved against its own folder. Raises as load_config."""
    tree, errors = _read_merged([path])
    experiment, more = check(Experiment, tree) if tree is not None else (None, [])
    _raise([*errors, *more])
    assert experiment is not None
    folder = Path(path).parent
    runs = [
        run.model_copy(update={"log": str(folder / run.log), "program": run.program and str(folder / run.program)})
        for run in experiment.runs
    ]
    return experiment.model_copy(update={"config": [str(folder / each) for each in experiment.config], "runs": runs})


def is_experiment(data: bytes) -> bool:
    """Whether YAML or JSON text is an experiment file: it has `runs` and no `robot`."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    start = rb"(?:^|[{,\n])[ \t]*" if data.lstrip().startswith(b"{") else rb"^"
    runs, robot = (
        re.search(start + rb"[\"']?" + key + rb"[\"']?\s*:", data, re.MULTILINE) for key in (b"runs", b"robot")
    )
    return runs is not None and robot is None


def _raise(errors: Sequence[CamcompError]) -> None:
    """Raise all errors: files that cannot be read first, then file by file from top to bottom."""

    def place(error: CamcompError) -> tuple[int, int, int]:
        return (files.index(error.at.file), error.at.line, error.at.column) if error.at else (-1, 0, 0)

    files = list(dict.fromkeys(error.at.file for error in errors if error.at))
    raise_all(sorted(errors, key=place))


def overridden(config: Config, over: Mapping[str, Any], starts: Mapping[str, float]) -> Config:
    """A loaded configuration with other values, and hinges of a robot of one chain that start at other angles.

    Args:
        config: as loaded.
        over: values by section and key.
        starts: start angle (deg) by the name of the hinge.

    Raises:
        ConfigError: a value is refused.
    """
    own = config.tree
    assert own is not None  # every loaded config has one
    tree = merge(own, tree_of(dict(over), own.at))
    if starts:
        tree = replace(tree, value={**tree.value, "robot": _starting(tree.value["robot"], starts)})
    found, errors = _check_config(tree)
    _raise(errors)
    assert found is not None
    found._spreads, found._doubts = config._spreads, config._doubts
    return in_stated_dialect(found)


def _starting(node: Node, starts: Mapping[str, float]) -> Node:
    """A tree in which every mapping with one of these names has its start angle."""
    if isinstance(node.value, list):
        return replace(node, value=[_starting(each, starts) for each in node.value])
    if not isinstance(node.value, dict):
        return node
    values = {key: _starting(each, starts) for key, each in node.value.items()}
    name = str(values["name"].value) if "name" in values else ""
    if name in starts:
        values["start_deg"] = Node(starts[name], node.at)
    return replace(node, value=values)


def varied(config: Config, source: UncertainInput, size: float) -> Config | None:
    """The configuration with one input `size` standard deviations off its value; None if the spec refuses it."""
    assert config.tree is not None  # every loaded config has one
    found, errors = _check_config(replaced(config.tree, _moved(source.members, size)))
    return None if errors else found


def _moved(spreads: Sequence[Spread], size: float) -> dict[tuple[str | int, ...], float]:
    return {each.keys: each.value + size * each.sd for each in spreads}


def _certain(tree: Node) -> tuple[Node, list[Spread], list[CamcompError]]:
    """The tree with plain values for uncertain numbers, their spreads, and the errors found.

    A number that the spec refuses one deviation above and one below its value cannot be uncertain (a number of teeth).
    """
    bare, spreads, errors = without_spreads(tree)
    if spreads:
        known = {each.at for each in _check_config(bare)[1]}
        sides = [
            {e.at for e in _check_config(replaced(bare, _moved(spreads, size)))[1]} - known for size in (-1.0, 1.0)
        ]
        for each in {each.at: each for each in spreads}.values():
            if each.sd > 0.0 and each.at in sides[0] & sides[1]:
                message = f"{each.name}: {each.value - each.sd:g} and {each.value + each.sd:g}, one deviation off, are refused"
                errors.append(ConfigError("CC284", message, at=each.at))
    return bare, spreads, errors


def _read_merged(paths: Sequence[Path | str]) -> tuple[Node | None, list[CamcompError]]:
    texts, errors = _read_texts(paths)
    tree, more = _merged_texts(texts)
    return tree, [*errors, *more]


def _read_texts(paths: Sequence[Path | str]) -> tuple[Texts, list[CamcompError]]:
    texts: list[tuple[Path | str, bytes]] = []
    errors: list[CamcompError] = []
    for path in paths:
        try:
            texts.append((path, read_bytes(path)))
        except FileError as error:
            errors.append(error)
    return texts, errors


def _merged_texts(texts: Texts) -> tuple[Node | None, list[CamcompError]]:
    merged: Node | None = None
    errors: list[CamcompError] = []
    for path, data in texts:
        if Path(path).suffix.lower() == linuxcnc_ini.SUFFIX:
            tree, wrong = linuxcnc_ini.read_layer(data, display_name(path))
            errors += wrong
            merged = tree if merged is None else merge(merged, tree) if tree is not None else merged
            continue
        from camcomp.model.config.yaml_text import read_tree  # slow import, needed without a kept configuration only

        tree, more = read_tree(data, display_name(path))
        if not _is_ours(tree, data) and not any(each.rule in ("CC211", "CC217") for each in more):
            message = "this is neither a machine file nor an experiment: it has none of their sections"
            errors.append(ConfigError("CC218", message, at=Location(display_name(path), 1, 1)))
            continue
        errors += more
        if tree is not None:
            merged = tree if merged is None else _merged(merged, tree)
    return merged, errors


def _merged(base: Node, over: Node) -> Node:
    """`merge`, and the entries of `effects:` one by one."""
    out, below, above = merge(base, over), _get(base, "effects"), _get(over, "effects")
    if below is None or above is None or not (isinstance(below.value, list) and isinstance(above.value, list)):
        return out
    entries = merged_entries(below.value, above.value, plain)
    return replace(out, value={**out.value, "effects": replace(above, value=entries)})


def _checked(tree: Node) -> tuple[Node, Config | None, list[CamcompError]]:
    """Merged files with the travel of LinuxCNC's axes and the tools of tool tables, their configuration, and the errors."""
    tree, doubts = linuxcnc_ini.with_travel(tree)
    tree, more, errors = with_tool_tables(tree)
    tree, spreads, uncertain = _certain(tree)
    config, wrong = _check_config(tree)
    if config is not None:
        config._spreads, config._doubts = tuple(spreads), (*doubts, *more)
    return tree, config, [*errors, *uncertain, *wrong]


def _is_ours(tree: Node | None, data: bytes) -> bool:
    """Whether a file can be meant for camcomp: it has a section, or a key with a name like one."""
    if tree is None:  # not YAML: by the look of its lines
        return bool(re.search(_SECTION, data))
    keys = tree.value if isinstance(tree.value, dict) else {}
    return any(key in _SECTIONS or get_close_matches(str(key)[:40], _SECTIONS, n=1) for key in keys)


def _check_config(tree: Node) -> tuple[Config | None, list[CamcompError]]:
    data, skip = plain(tree), []
    errors: list[CamcompError] = []
    robot = _get(tree, "robot")
    if robot is not None and _get(robot, "type") is not None:
        data["robot"], errors = _robot_from_plugin(robot)
    if robot is None or (errors and data["robot"] is None):
        skip = ["robot"]  # missing in a file of overrides, or its own errors are known already
    config, more = check(Config, tree, data, skip=skip)
    errors += more
    force, more = _plugin("forces", "model", _get(tree, "process", "force") or _NO_FORCE, name="process.force")
    errors += more
    entries = _get(tree, "effects")
    listed = entries.value if entries is not None and isinstance(entries.value, list) else []
    effects = [
        _plugin("effects", "effect", entry, name=f"effects[{i + 1}]", also=("target",))
        for i, entry in enumerate(listed)
    ]
    errors += [each for _, more in effects for each in more]
    errors += _dialect(_get(tree, "control", "dialect"))
    if config is None or errors:
        return None, errors
    config._tree = tree
    config.process.force._params = force
    for choice, (params, _) in zip(config.effects, effects, strict=True):
        choice._params = params
    return config, _check_targets(config)


def _robot_from_plugin(node: Node) -> tuple[RobotSpec | None, list[CamcompError]]:
    chosen = node.value["type"]
    if not isinstance(chosen.value, str):
        return None, [ConfigError("CC204", "robot.type: has to be the name of a kind of robot", at=chosen.at)]
    if "chains" in node.value:
        message = "a robot is given by its type or by its chains, not by both"
        return None, [ConfigError("CC215", message, at=node.value["chains"].key_at)]
    params, errors = _plugin("robots", "type", node, name="robot", also=ROBOT_KEYS)
    if params is None or errors:
        return None, errors
    chains = shelf.load("robots", chosen.value).chains(params)
    own = {key: node.value[key] for key in ROBOT_KEYS if key in node.value}
    # Errors in the chains of a plug-in get the location of the plug-in's name.
    tree = replace(node, value={**own, "chains": tree_of(chains, chosen.at)})
    data = {**{key: plain(each) for key, each in own.items()}, "chains": chains}
    robot, errors = check(RobotSpec, tree, data, name=f"robot '{chosen.value}'")
    return robot and robot.model_copy(update={"type": chosen.value}), errors


def _plugin(
    shelf_name: str, key: str, node: Node | None, *, name: str = "", also: Sequence[str] = ()
) -> tuple[Any, list[CamcompError]]:
    """Parameters of the plug-in that `node` names under `key`, as its own spec, and errors; None for a bad name."""
    chosen = _get(node, key)
    if node is None or chosen is None or not isinstance(chosen.value, str):
        return None, []  # missing or mistyped: the spec of the section says so
    try:
        member = shelf.load(shelf_name, chosen.value, at=chosen.at)
    except ConfigError as error:
        return None, [error]
    own = {each: below for each, below in node.value.items() if each not in (key, *also)}
    try:
        with shelf.blaming(shelf_name, chosen.value):
            return check(params_of(member), replace(node, value=own), name=name)
    except FileError as error:  # a table that its parameters name
        error.at = error.at or (_get(node, "file") or chosen).at
        return None, [error]


def _dialect(chosen: Node | None) -> list[CamcompError]:
    if chosen is None or not isinstance(chosen.value, str):
        return []
    try:
        shelf.load("dialects", chosen.value, at=chosen.at)
    except ConfigError as error:
        return [error]
    return []


def params_of(member: Any) -> type[Spec]:
    """A plug-in's spec: its class Params, and for an effect one with its records PARAMETERS as well."""
    if getattr(member, "PARAMETERS", ()) or not hasattr(member, "Params"):
        fields: dict[str, Any] = {each.name: (_number_of(each, member), each.nominal) for each in member.PARAMETERS}
        return create_model("Parameters", __base__=getattr(member, "Params", Spec), **fields)
    out: type[Spec] = member.Params
    return out


def _number_of(parameter: Any, member: Any) -> Any:
    """Type of an effect's number: its bounds, what it is, and its typical size as an example."""
    about = (member.__doc__ or "").strip().split("\n")[0].removesuffix(".")
    text = f"{about}; {parameter.low:g} to {parameter.high:g}, {parameter.source}"
    size = parameter.scan[len(parameter.scan) // 2] if parameter.scan else parameter.value(parameter.scale)
    return Annotated[
        float, Field(ge=parameter.low, le=parameter.high, description=text, examples=[float(f"{size:.3g}")])
    ]


def _check_targets(config: Config) -> list[CamcompError]:
    """Errors for effects with a wrong target; it is an actuator of this robot, a name of the effect, or absent."""
    actuators = list(config.robot.actuators)
    errors: list[CamcompError] = []
    for i, each in enumerate(config.effects):
        at = config.at("effects", i, "target" if each.target is not None else "effect")
        effect = shelf.load("effects", each.effect)
        kind = getattr(effect, "TARGET", "either")
        names = list(effect.TARGETS) if kind == "named" else actuators
        if kind == "named" and each.target not in names:
            said = f"has no target '{each.target}'" if each.target is not None else "needs a target"
            message, hint = f"'{each.effect}' {said}", choose(each.target or "", names)
        elif strange := _not_of_target(effect, each):
            at = config.at("effects", i, strange)
            message, hint = f"'{strange}' is nothing of {each.target}", choose(strange, effect.OF_TARGET[each.target])
        elif each.target is not None and each.target not in names:
            message, hint = f"there is no actuator '{each.target}'", choose(each.target, names)
        elif kind == "actuator" and each.target is None:
            message, hint = f"'{each.effect}' needs a target", f"add target: one of {', '.join(names)}"
        elif kind != "named" and getattr(effect, "SLIDES_ONLY", False) and (hinge := _hinge(config, each.target)):
            message, hint = f"'{hinge}' is a hinge, and '{each.effect}' is of slides", None
        elif each.target is not None and getattr(each.params, "axis", None) is not None:
            message, hint = "a law on the tip has no target", "leave the target out; its axis says where it acts"
        elif other := next((a for a in getattr(each.params, "loads_of", ()) if a not in actuators), None):
            at = config.at("effects", i, "effect")
            message, hint = f"there is no drive '{other}' to have a load", choose(other, actuators)
        elif kind == "machine" and each.target is not None:
            message, hint = f"'{each.effect}' concerns the machine as a whole", "leave the target out"
        else:
            continue
        errors.append(ConfigError("CC205", f"effects[{i + 1}]: {message}", at=at, hint=hint))
    return errors + _check_twice(config)


def _check_twice(config: Config) -> list[CamcompError]:
    """Errors for an effect that is listed twice at one target: it would act twice, and a diagnosis could not change it."""
    errors: list[CamcompError] = []
    seen: dict[tuple[Any, ...], int] = {}
    for i, each in enumerate(config.effects):
        key = key_of_effect(each.effect, each.target, each.values)
        other = seen.get(key)
        if other is None and getattr(shelf.load("effects", each.effect), "TARGET", "either") == "either":
            alike = [k for k in seen if k[0] == each.effect and k[2:] == key[2:] and None in (k[1], each.target)]
            other = seen[alike[0]] if alike else None
        if other is not None:
            where = "" if each.target is None else f" at {each.target}"
            message = f"effects[{i + 1}]: '{each.effect}'{where} is there already, as effects[{other + 1}]"
            at = config.at("effects", i, "effect")
            errors.append(ConfigError("CC205", message, at=at, hint="write one entry with the value of both together"))
        seen.setdefault(key, i)
    return errors


def _not_of_target(effect: Any, choice: EffectChoice) -> str | None:
    """A key of an effect that does not apply to its target, or None."""
    of = getattr(effect, "OF_TARGET", {})
    some = {key for keys in of.values() for key in keys}
    return next((key for key in choice.given if key in some and key not in of.get(choice.target, ())), None)


def _hinge(config: Config, target: str | None) -> str | None:
    """The first hinge among the actuators that an effect with that target acts on."""
    every = config.robot.actuators
    return next((a for a in every if target in (None, a) and isinstance(every[a], RevoluteActuator)), None)


def _get(node: Node | None, *keys: str) -> Node | None:
    for key in keys:
        node = node.value.get(key) if node is not None and isinstance(node.value, dict) else None
    return node
