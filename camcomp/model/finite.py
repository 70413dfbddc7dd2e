"""Error for results that are NaN or infinite, which comparisons and means would pass on silently."""

from camcomp.ground.errors import Location, PhysicsError
from camcomp.model.config.spec import Config


def not_finite(config: Config, what: str, at: Location | None = None) -> PhysicsError:
    """Error CC306 for a result; it names the effects and the force model as possible origins.

    at: location in the program; default: the effects or the force model in the YAML.
    """
    effects = list(dict.fromkeys(f"effect '{each.effect}'" for each in config.effects))
    force = config.process.force.model
    force_model = [] if force == "none" else [f"force model '{force}'"]
    written = config.at("effects") if effects else config.at("process", "force")
    makers = ", ".join(effects + force_model) or "the values of the robot"
    return PhysicsError("CC306", f"{what} is not finite; what makes it: {makers}", at=at or written)
