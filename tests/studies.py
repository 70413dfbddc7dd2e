"""Results of studies of logs without programs."""

from camcomp.diagnosis.arm.study import studied as studied_arm
from camcomp.diagnosis.axis.study import studied as studied_axes


def axis_study(*given, **more):
    """The result for logs of axes."""
    return studied_axes(*given, **more)[0]


def arm_study(*given, **more):
    """The result for static poses of an arm."""
    return studied_arm(*given, **more)[0]
