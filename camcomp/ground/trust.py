"""Whether others than the user can put or change files in a folder: code from there would be theirs, run as the user.

Owners other than the user and root, and write permission for others, count as distrust. Write permission of a group counts
unless the group is the user's own (same name as the user, no further members), which is what umask 002 is made for. On
systems without POSIX owners nothing is asked.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path


def why_folder_is_not_ours(folder: Path) -> str | None:
    """Who else can change what lies in `folder`, itself or through a folder above it; None where nobody can."""
    if not hasattr(os, "getuid"):
        return None
    real = Path(os.path.realpath(folder))
    for each in (real, *real.parents):
        try:
            status = os.stat(each)
        except OSError:
            continue  # not there yet: who makes it decides, and the folder above is asked
        sticky = each != real and bool(status.st_mode & stat.S_ISVTX)  # as /tmp: entries belong to those who made them
        if (reason := _why(status, sticky)) is not None:
            return f"{each} {reason}"
    return None


def why_file_is_not_ours(handle: int) -> str | None:
    """Who else can change the open file; None where nobody can."""
    status = os.fstat(handle)
    if not stat.S_ISREG(status.st_mode):
        return "is no regular file"
    return _why(status, False) if hasattr(os, "getuid") else None


def _why(status: os.stat_result, sticky: bool) -> str | None:
    if status.st_uid not in (os.getuid(), 0):
        return "belongs to another user"
    if sticky:
        return None
    if status.st_mode & stat.S_IWOTH:
        return "can be written by every user"
    if status.st_mode & stat.S_IWGRP and not _is_own_group(status.st_gid):
        return "can be written by a group"
    return None


def _is_own_group(number: int) -> bool:
    """Whether the group is the one that systems make for the user alone."""
    if number == 0:
        return True  # root's
    import grp
    import pwd

    try:
        group, user = grp.getgrgid(number), pwd.getpwuid(os.getuid())
    except KeyError:
        return False
    return group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name}
