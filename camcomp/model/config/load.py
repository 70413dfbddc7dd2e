"""YAML files to checked specs and plug-ins. Every mistake of every file is reported at once."""

import re
from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, create_model

from camcomp.ground import shelf
from camcomp.ground.errors import CamcompError, ConfigError, FileError, Location, raise_all
from camcomp.ground.files import display_name, read_bytes
from camcomp.model.config.base import Spec
from camcomp.model.config.robot import RobotSpec
from camcomp.model.config.spec import Config, Experiment
from camcomp.model.config.yaml_check import check, choose
from camcomp.model.config.yaml_tree import Node, merge, plain, read_tree, tree_of

ROBOT_KEYS = (
    "name",
    "source",
    "start_reference_mm",
)  # belong to the robot, whatever plug-in builds its chains

_SECTIONS = tuple(key for spec in (Config, Experiment) for key in spec.yaml_keys() if key != "source")
_SECTION = re.compile(rb"(^|[{,])[ \t\"']*(%s)[\"']?[ \t]*:([ \t\r\n]|$)" % "|".join(_SECTIONS).encode(), re.MULTILINE)
_NO_FORCE = Node({"model": Node("none", Location("", 1, 1))}, Location("", 1, 1))


def load_config(paths: Sequence[Path | str]) -> Config:
    """The configuration that `paths` make together: later files over earlier ones, key by key.

    Raises ConfigError (exit code 2) with every mistake of every file, FileError (5) when a file cannot be read.
    """
    tree, errors = _read_merged(paths)
    if tree is None:
        _raise(errors)
        raise ConfigError("CC212", "no configuration is given", hint="name one with --config FILE")
    if _get(tree, "robot") is None:
        errors.append(ConfigError("CC212", "there is no section 'robot'", at=tree.at))
    config, more = _check_config(tree)
    _raise([*errors, *more])
    assert config is not None
    return config


def check_config(paths: Sequence[Path | str]) -> None:
    """Raise what is wrong with `paths`, which need not be complete.

    Without the name of a robot they are overrides of some machine file, where any key may be missing.
    """
    tree, errors = _read_merged(paths)
    more = _check_config(tree)[1] if tree is not None else []
    if _get(tree, "robot", "name") is None:
        more = [each for each in more if each.rule != "CC203"]
    _raise([*errors, *more])


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
    """Whether YAML text is an experiment file: it has `runs` and no `robot`."""
    return bool(re.search(rb"^(\xef\xbb\xbf)?runs\s*:", data, re.MULTILINE)) and not re.search(
        rb"^robot\s*:", data, re.MULTILINE
    )


def _raise(errors: Sequence[CamcompError]) -> None:
    """Raise all errors: files that cannot be read first, then file by file from top to bottom."""

    def place(error: CamcompError) -> tuple[int, int, int]:
        return (files.index(error.at.file), error.at.line, error.at.column) if error.at else (-1, 0, 0)

    files = list(dict.fromkeys(error.at.file for error in errors if error.at))
    raise_all(sorted(errors, key=place))


def _read_merged(paths: Sequence[Path | str]) -> tuple[Node | None, list[CamcompError]]:
    merged: Node | None = None
    errors: list[CamcompError] = []
    for path in paths:
        try:
            data = read_bytes(path)
        except FileError as error:
            errors.append(error)
            continue
        tree, more = read_tree(data, display_name(path))
        if not _is_ours(tree, data) and not any(each.rule in ("CC211", "CC217") for each in more):
            message = "this is neither a machine file nor an experiment: it has none of their sections"
            errors.append(ConfigError("CC218", message, at=Location(display_name(path), 1, 1)))
            continue
        errors += more
        if tree is not None:
            merged = tree if merged is None else merge(merged, tree)
    return merged, errors


def _is_ours(tree: Node | None, data: bytes) -> bool:
    """Whether a file can be meant for camcomp: it has a section, or a key that is nearly called like one."""
    if tree is None:  # not YAML: by the look of its lines
        return bool(_SECTION.search(data))
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
    # What is wrong with chains that a plug-in made is told where the plug-in is named.
    tree = replace(node, value={**own, "chains": tree_of(chains, chosen.at)})
    data = {**{key: plain(each) for key, each in own.items()}, "chains": chains}
    robot, errors = check(RobotSpec, tree, data, name=f"robot '{chosen.value}'")
    return robot and robot.model_copy(update={"type": chosen.value}), errors


def _plugin(
    shelf_name: str, key: str, node: Node | None, *, name: str = "", also: Sequence[str] = ()
) -> tuple[Any, list[CamcompError]]:
    """Parameters of the plug-in that `node` names under `key`, as its own spec; None when it has none."""
    chosen = _get(node, key)
    if node is None or chosen is None or not isinstance(chosen.value, str):
        return None, []  # missing or mistyped: the spec of the section says so
    try:
        member = shelf.load(shelf_name, chosen.value, at=chosen.at)
    except ConfigError as error:
        return None, [error]
    own = {each: below for each, below in node.value.items() if each not in (key, *also)}
    with shelf.blaming(shelf_name, chosen.value):
        return check(params_of(member), replace(node, value=own), name=name)


def _dialect(chosen: Node | None) -> list[CamcompError]:
    if chosen is None or not isinstance(chosen.value, str):
        return []
    try:
        shelf.load("dialects", chosen.value, at=chosen.at)
    except ConfigError as error:
        return [error]
    return []


def params_of(member: Any) -> type[Spec]:
    """A plug-in's spec: its class Params, or one made from the records PARAMETERS of an effect."""
    if hasattr(member, "PARAMETERS"):
        fields: dict[str, Any] = {
            each.name: (Annotated[float, Field(ge=each.low, le=each.high)], each.nominal) for each in member.PARAMETERS
        }
        return create_model("Parameters", __base__=Spec, **fields)
    out: type[Spec] = member.Params
    return out


def _check_targets(config: Config) -> list[CamcompError]:
    """Whether every effect has the target it needs: an actuator of this robot, or none."""
    names = list(config.robot.actuators)
    errors: list[CamcompError] = []
    for i, each in enumerate(config.effects):
        at = config.at("effects", i, "target" if each.target is not None else "effect")
        kind = getattr(shelf.load("effects", each.effect), "TARGET", "either")
        if each.target is not None and each.target not in names:
            message, hint = f"there is no actuator '{each.target}'", choose(each.target, names)
        elif kind == "actuator" and each.target is None:
            message, hint = f"'{each.effect}' needs a target", f"add target: one of {', '.join(names)}"
        elif kind == "machine" and each.target is not None:
            message, hint = f"'{each.effect}' concerns the machine as a whole", "leave the target out"
        else:
            continue
        errors.append(ConfigError("CC205", f"effects[{i + 1}]: {message}", at=at, hint=hint))
    return errors


def _get(node: Node | None, *keys: str) -> Node | None:
    for key in keys:
        node = node.value.get(key) if node is not None and isinstance(node.value, dict) else None
    return node
