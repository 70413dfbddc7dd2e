"""YAML files to checked specs and plug-ins. Every mistake of every file is reported at once."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from camcomp import shelf
from camcomp.diagnostics import CamcompError, ConfigError, FileError, raise_all
from camcomp.files import display_name, read_bytes
from camcomp.spec import Config, Experiment
from camcomp.specrobot import Robot
from camcomp.yamlcheck import check, choose
from camcomp.yamltree import Node, merge, plain, read_tree

_ROBOT_KEYS = (
    "name",
    "source",
    "start_reference_mm",
)  # belong to the robot, whatever plug-in builds its chains


def load_config(paths: Sequence[Path | str]) -> Config:
    """The configuration that `paths` make together: later files over earlier ones, key by key.

    Raises ConfigError (exit code 2) with every mistake of every file, FileError (5) when a file cannot be read.
    """
    tree, errors = _read_merged(paths)
    if tree is None:
        raise_all(errors)
        raise ConfigError("CC212", "no configuration is given", hint="name one with --config FILE")
    if _get(tree, "robot") is None:
        errors.append(ConfigError("CC212", "there is no section 'robot'", at=tree.at))
    config, more = _check_config(tree)
    raise_all([*errors, *more])
    assert config is not None
    return config


def check_config(paths: Sequence[Path | str]) -> None:
    """Raise what is wrong with `paths`, which need not be complete: a file of overrides may lack the robot."""
    tree, errors = _read_merged(paths)
    raise_all([*errors, *(_check_config(tree)[1] if tree is not None else [])])


def load_experiment(path: Path | str) -> Experiment:
    """An experiment file, its paths resolved against its own folder. Raises as load_config."""
    tree, errors = _read_merged([path])
    experiment, more = check(Experiment, tree) if tree is not None else (None, [])
    raise_all([*errors, *more])
    assert experiment is not None
    folder = Path(path).parent
    runs = [
        run.model_copy(
            update={"log": str(folder / run.log), "program": run.program and str(folder / run.program)}
        )
        for run in experiment.runs
    ]
    return experiment.model_copy(
        update={"config": [str(folder / each) for each in experiment.config], "runs": runs}
    )


def is_experiment(data: bytes) -> bool:
    """Whether YAML text is an experiment file: it has `runs` and no `robot`."""
    tree, _ = read_tree(data, "")
    return _get(tree, "runs") is not None and _get(tree, "robot") is None


def _read_merged(paths: Sequence[Path | str]) -> tuple[Node | None, list[CamcompError]]:
    merged: Node | None = None
    errors: list[CamcompError] = []
    for path in paths:
        try:
            tree, more = read_tree(read_bytes(path), display_name(path))
        except FileError as error:
            errors.append(error)
            continue
        errors += more
        if tree is not None:
            merged = tree if merged is None else merge(merged, tree)
    return merged, errors


def _check_config(tree: Node) -> tuple[Config | None, list[CamcompError]]:
    data, skip = plain(tree), []
    errors: list[CamcompError] = []
    robot = _get(tree, "robot")
    if robot is not None and _get(robot, "type") is not None:
        data["robot"], errors = _robot_from_plugin(robot)
    if not isinstance(data, dict) or data.get("robot") is None:
        skip = ["robot"]  # missing in a file of overrides, or its own errors are known already
    config, more = check(Config, tree, data, skip=skip)
    errors += more
    force, more = _plugin("forces", "model", _get(tree, "process", "force"))
    errors += more
    entries = _get(tree, "effects")
    listed = entries.value if entries is not None and isinstance(entries.value, list) else []
    effects = [_plugin("effects", "effect", entry, also=("target",)) for entry in listed]
    errors += [each for _, more in effects for each in more]
    errors += _plugin("dialects", "dialect", _get(tree, "control"), free=True)[1]
    if config is None or errors:
        return None, errors
    config._tree = tree
    config.process.force._params = force
    for choice, (params, _) in zip(config.effects, effects, strict=True):
        choice._params = params
    return config, _check_targets(config)


def _robot_from_plugin(node: Node) -> tuple[Robot | None, list[CamcompError]]:
    if "chains" in node.value:
        message = "a robot is given by its type or by its chains, not by both"
        return None, [ConfigError("CC215", message, at=node.value["chains"].key_at)]
    params, errors = _plugin("robots", "type", node, also=_ROBOT_KEYS)
    if params is None or errors:
        return None, errors
    chains = shelf.load("robots", node.value["type"].value).chains(params)
    own = {key: plain(node.value[key]) for key in _ROBOT_KEYS if key in node.value}
    robot, errors = check(Robot, node, {**own, "chains": chains})
    return robot and robot.model_copy(update={"type": node.value["type"].value}), errors


def _plugin(
    shelf_name: str, key: str, node: Node | None, *, also: Sequence[str] = (), free: bool = False
) -> tuple[Any, list[CamcompError]]:
    """Parameters of the plug-in that `node` names under `key`, checked by its Params; None when it has none."""
    chosen = _get(node, key)
    if node is None or chosen is None or not isinstance(chosen.value, str):
        return None, []  # missing or mistyped: the spec of the section says so
    try:
        member = shelf.load(shelf_name, chosen.value, at=chosen.at)
    except ConfigError as error:
        return None, [error]
    if free or not hasattr(member, "Params"):
        return None, []
    own = {name: each for name, each in node.value.items() if name != key and name not in also}
    return check(member.Params, replace(node, value=own))


def _check_targets(config: Config) -> list[CamcompError]:
    names = list(config.robot.actuators) if config.robot is not None else []
    return [
        ConfigError(
            "CC205",
            f"effects[{i + 1}].target: there is no actuator '{each.target}'",
            at=config.at("effects", i, "target"),
            hint=choose(each.target, names),
        )
        for i, each in enumerate(config.effects)
        if each.target is not None and each.target not in names
    ]


def _get(node: Node | None, *keys: str) -> Node | None:
    for key in keys:
        node = node.value.get(key) if node is not None and isinstance(node.value, dict) else None
    return node
