"""Contract of effects, checked when a user's effect is loaded."""

import math
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from types import ModuleType
from typing import TYPE_CHECKING, Any, Protocol, get_args

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError
from camcomp.model.config.load import params_of
from camcomp.model.effect import Axes, Load, Motion, Parameter, Target, nominal
from camcomp.model.signal_path import INVERSE, STAGES
from camcomp.model.statics.description import Robot
from camcomp.plugins.contract import (
    check_functions,
    check_module,
    check_names,
    described,
    failure,
    guarded,
    has_nan,
    refusal,
    same,
    with_functions,
    wrong_array,
)
from camcomp.plugins.parameters import check_params

if TYPE_CHECKING:  # the contract does not need the solver
    from camcomp.model.motion.twin import Reading

_ALSO = ("public", "applies", "first_guess", "guess", INVERSE)
_SOME = slice(1, None, 3)  # instants of a trial
_YAML_KEYS = {"effect", "target", "source"}  # keys of the same mapping as the parameters


class EffectPlugin(Protocol):
    """One difference between a machine and its model: a module with these names and at least one hook of EffectHooks.

    At the nominal values of the parameters every hook returns its input unchanged, bit for bit. Optional names:

    - PLAIN: short text in the language of a workshop, "play in the drive". REMEDY: advice, without a capital.
    - FITTED: tuple of Parameter that a diagnosis fits in place of PARAMETERS, with the function `public` (values of FITTED
      -> values of PARAMETERS).
    - FITTED_AHEAD: what is fitted in place of FITTED in logs of axes whose encoders are ahead of their set-points.
    - `applies`: (robot, target) -> whether it is a candidate of a diagnosis there; default: always.
    - `first_guess`: list of time (n,) s, set-points (n,), encoders (n,) of an actuator -> initial value of its one shape.
    - TARGETS: tuple of names for TARGET "named", with OF_TARGET (target -> keys that apply there) and SOUGHT (target ->
      parameters that a diagnosis fits there).
    - ROTARY: parameters of a hinge. ARM_ONLY: for serial arms. SLIDES_ONLY: for slides.
    - MOMENTARY: True: on_drive and on_drive_force have no memory.
    - WARMS: compensate needs the temperature.
    - GEOMETRY: True: an error of the arm's geometry, which absolutely accurate controllers correct themselves.
    - MODELLED_FORCE: True: an error of the force model, which does not change measured forces.
    - COULOMB: names of parameters: Coulomb force at the guide, which holds a carriage within the play of its drive.
    - `invert_servo`: inverse of on_servo, with its arguments: encoders -> set-points (n, m); compensate leads the commands through it
      instead of approaching them in many steps. STAYS_BEHIND: True: at constant speed the encoder is not at its set-point.
    - UNCORRECTABLE: True: compensate does not correct its error.
    - Params: Spec of further YAML keys, which are never fitted.
    """

    STAGE: str  # control | drive | structure | process | tool | workpiece | sensor: origin of the difference
    TARGET: Target  # "actuator": one cause per actuator; "machine": target null; "either"; "named": one of TARGETS
    PARAMETERS: tuple[Parameter, ...]
    SOURCE: str  # reference of the formula


class EffectHooks(Protocol):
    """Hooks of effects in the order of the signal path; n rows, m actuators, mm or rad, N, s.

    `p` maps parameter names to values; `which` (m,) is 1.0 for the target actuators, else 0.0. Arguments must not be
    changed in place.
    """

    def on_servo(self, position: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
        """Set-points (n, m) in time -> encoders."""

    def on_drive(self, error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
        """Carriage minus encoder (n, m)."""

    def on_drive_force(self, force: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
        """Force (n, m) of the drives beyond the load of the structure."""

    def on_robot(self, robot: Robot, actuators: tuple[str, ...], p: Mapping[str, float]) -> Robot:
        """Description of the machine -> changed copy; `actuators`: names of the targets."""

    def on_load(self, load: Load, motion: Motion, p: Mapping[str, float]) -> Load:
        """Load at the tool."""

    def on_links(self, length: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
        """Growth (n, m) mm of the links behind the actuators."""

    def on_guideway(self, tip: Floats, axes: Axes, target: str, p: Mapping[str, float]) -> Floats:
        """Tips (n, 3) in the machine frame of axes X, Y, Z that are neither straight nor square; target: as in YAML."""

    def on_pose(self, tip: Floats, load: Load, motion: Motion, p: Mapping[str, float]) -> Floats:
        """Tips (n, 3) in the machine frame."""

    def on_workpiece(self, tip: Floats, p: Mapping[str, float]) -> Floats:
        """Tips (n, 3) in the program frame."""

    def on_place(self, tip: Floats, load: Load, motion: Motion, p: Mapping[str, float]) -> Floats:
        """Tips (n, 3) in the program frame, behind the workpiece."""

    def on_clock(self, time: Floats, p: Mapping[str, float]) -> Floats:
        """Time stamps (n,) of rows -> times at which the tip was at the positions of the rows."""

    def on_reading(self, reading: "Reading", motion: Motion, p: Mapping[str, float]) -> "Reading":
        """Readings of the sensors."""


def checked(name: str, found: Any, who: str) -> ModuleType:
    """The effect behind an entry point, its hooks guarded. Raises ConfigError CC280."""
    del name
    module = check_module(who, found)
    check_names(who, module, {"STAGE": str, "TARGET": str, "PARAMETERS": tuple, "SOURCE": str})
    for key, allowed in (("STAGE", STAGES), ("TARGET", get_args(Target))):
        if (value := getattr(module, key)) not in allowed:
            raise refusal(who, f"{key} is '{value}', not one of {', '.join(allowed)}")
    if module.TARGET == "named" and not _are_names(getattr(module, "TARGETS", None)):
        raise refusal(who, "TARGET is 'named', and TARGETS is no tuple of names")
    hooks = check_functions(who, module, EffectHooks, _ALSO)
    if not hooks:
        raise refusal(
            who, "there is no hook", hint=f"one of {', '.join(each for each in dir(EffectHooks) if each[:3] == 'on_')}"
        )
    if not module.PARAMETERS and not hasattr(module, "Params"):
        raise refusal(who, "PARAMETERS is empty")
    check_names(who, module, {key: str for key in ("PLAIN", "REMEDY") if hasattr(module, key)})
    for key in ("PARAMETERS", "FITTED", "FITTED_AHEAD", "ROTARY"):
        _check_parameters(who, key, getattr(module, key, ()))
    if hasattr(module, "Params"):
        check_params(who, module.Params, {*_YAML_KEYS, *nominal(module)} - {"source"})
    _check_spec(who, module)
    wrapped = {each: guarded(who, each, getattr(module, each), partial(_wrong, each)) for each in hooks}
    if hasattr(module, "public"):
        wrapped["public"] = guarded(who, "public", module.public, partial(_wrong_values, module))
    if hasattr(module, "applies"):
        wrapped["applies"] = guarded(who, "applies", module.applies, _no_answer)
    inverse = (INVERSE,) if hasattr(module, INVERSE) else ()
    wrapped |= {each: guarded(who, each, getattr(module, each), partial(_wrong, each)) for each in inverse}
    effect = with_functions(module, wrapped)
    _try(who, effect, hooks + inverse)
    return effect


def _are_names(found: Any) -> bool:
    return isinstance(found, tuple) and bool(found) and all(isinstance(each, str) and each for each in found)


def _check_parameters(who: str, key: str, parameters: Any) -> None:
    if not isinstance(parameters, tuple):
        raise refusal(who, f"{key} is {described(parameters)}, not a tuple of Parameter")
    for i, each in enumerate(parameters):
        if not isinstance(each, Parameter):
            hint = "a tuple of one needs a comma: (Parameter(...),)" if len(parameters) == 1 else None
            raise refusal(who, f"{key}[{i}] is {described(each)}, not a Parameter", hint=hint)
        if why := _wrong_parameter(each):
            raise refusal(who, f"{key}: {each.name!r} {why}")
    names = [each.name for each in parameters]
    if twice := {each for each in names if names.count(each) > 1}:
        raise refusal(who, f"{key}: {', '.join(sorted(twice))} is there twice")


def _wrong_parameter(p: Any) -> str:
    """Error text for an invalid parameter; empty: valid."""
    if not isinstance(p.name, str) or not p.name.isidentifier() or p.name in _YAML_KEYS or p.name.startswith("_"):
        return "cannot be a key in YAML"
    if not (isinstance(p.unit, str) and isinstance(p.source, str)):
        return "needs unit and source as text"
    numbers = (p.nominal, p.low, p.high, p.scale, p.tolerance, *p.scan, *p.either)
    if not all(isinstance(each, (int, float)) and not math.isnan(each) for each in numbers):
        return "has something in place of a number"
    if not p.low <= p.nominal <= p.high or not math.isfinite(p.nominal):
        return f"has the nominal value {p.nominal:g} outside its bounds {p.low:g} to {p.high:g}"
    if not 0.0 < p.scale < math.inf or not 0.0 <= p.tolerance < math.inf:
        return "needs a scale above zero and a tolerance of zero or more"
    if p.sign not in (0, 1):
        return f"has the sign {p.sign}, not 0 or +1"
    if p.log and not p.low > 0.0:
        return "is a factor (log) with a bound that is not above zero"
    if not all(p.low <= each <= p.high for each in (*p.scan, *p.either)):
        return "has a value to scan outside its bounds"
    return ""


def _check_spec(who: str, module: ModuleType) -> None:
    """Raise ConfigError CC280 for parameters that cannot be keys of a YAML mapping."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            params_of(module).model_json_schema()
    except Exception as error:
        raise refusal(who, f"its parameters cannot be keys in YAML: {error}") from error


def _wrong(hook: str, result: Any, given: Any, *rest: Any) -> str:
    """Error text for an invalid result of a hook; empty: valid."""
    if hook == "on_robot":
        return _wrong_robot(result, given)
    if hook == "on_load":
        if not isinstance(result, Load):
            return f"{described(result)}, not a Load"
        wrong = (wrong_array(getattr(result, each), getattr(given, each), *rest) for each in ("force", "wrench"))
        return next((f"a Load with {each}" for each in wrong if each), "")
    if hook == "on_reading":
        if not isinstance(result, type(given)):
            return f"{described(result)}, not a {type(given).__name__}"
        pairs = ((getattr(result, each), getattr(given, each)) for each in ("tip", "encoder", "drive", "dyno"))
        wrong = (wrong_array(mine, was, *rest) for mine, was in pairs)
        return next((f"a {type(given).__name__} with {each}" for each in wrong if each), "")
    return wrong_array(result, given, *rest)


def _wrong_robot(result: Any, given: Robot) -> str:
    if not isinstance(result, Robot):
        return f"{described(result)}, not a Robot"
    if [each.name for each in result.actuators] != [each.name for each in given.actuators]:
        return "a Robot with other actuators"
    return "a Robot with a number that is none" if has_nan(result) and not has_nan(given) else ""


def _wrong_values(module: ModuleType, result: Any, *_given: Any) -> str:
    names = {each.name for each in module.PARAMETERS}
    if not isinstance(result, Mapping) or not names <= set(result) <= names | _more_keys(module):
        return f"{described(result)}, not a value for each of PARAMETERS"
    return "a value that is no number" if has_nan(dict(result)) else ""


def _no_answer(result: Any, *_given: Any) -> str:
    return "" if isinstance(result, (bool, np.bool_)) else f"{described(result)}, not True or False"


def _try(who: str, effect: ModuleType, hooks: tuple[str, ...]) -> None:
    """Try every hook on small machines: no change at nominal, and no error at a typical size on at least one machine.

    An effect may be meant for one kind of machine only, so that its failure on the other one does not count.
    """
    from camcomp.plugins import trial

    machines = [trial.arm()] if getattr(effect, "ARM_ONLY", False) else [trial.legs(), trial.arm()]
    failed: list[ConfigError] = []
    for robot in machines:
        try:
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                for hook in hooks:
                    named = getattr(effect, "TARGETS", (None,))[0]
                    given = trial.inputs(robot, whole=effect.TARGET == "machine", named=named)
                    _try_hook(who, effect, hook, given)
        except ConfigError as error:
            if error.rule == "CC280":
                raise
            failed.append(error)
    if len(failed) == len(machines):
        raise ConfigError("CC280", f"{failed[0].message} in a trial", at=failed[0].at) from failed[0].__cause__


def _try_hook(who: str, effect: ModuleType, hook: str, given: Mapping[str, tuple[Any, ...]]) -> None:
    call: Callable[..., Any] = getattr(effect, hook)
    if not same(call(*given[hook], nominal(effect)), given[hook][0]):
        raise refusal(who, f"{hook} changes something at the nominal values of all parameters")
    answer = call(*given[hook], _away(who, effect))
    if getattr(effect, "MOMENTARY", False) and hook in ("on_drive", "on_drive_force"):
        values, motion, which = given[hook]
        some = call(values[_SOME], motion.at(_SOME), which, _away(who, effect))
        if not np.allclose(some, answer[_SOME], rtol=1e-9, atol=0.0, equal_nan=True):
            raise refusal(who, f"MOMENTARY is True, but what {hook} answers depends on the instants before")


def _more_keys(effect: Any) -> set[str]:
    """YAML keys of the effect's class Params."""
    return set(effect.Params.yaml_keys()) if hasattr(effect, "Params") else set()


def _away(who: str, effect: ModuleType) -> dict[str, float]:
    """Parameters at a typical size from nominal, shape parameters at nominal."""
    fitted = getattr(effect, "FITTED", effect.PARAMETERS)
    values = {p.name: p.nominal if p.shape else p.value(p.scale) for p in fitted}
    if hasattr(effect, "public"):
        values = dict(effect.public(values))
    if unknown := set(values) - set(nominal(effect)) - _more_keys(effect):
        raise failure(
            who, f"FITTED has {', '.join(sorted(unknown))}, which is not in PARAMETERS, and there is no `public`"
        )
    return {**nominal(effect), **values}
