"""Check whether other users can write to a folder or file, whose code would run with the rights of this user.

Files are distrusted if their owner is neither the user nor root, or if others have write permission. Write permission of a
group counts unless the group is the user's own (same name as the user, no further members), as with umask 002. Systems
without POSIX owners are not checked.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path


def why_folder_is_not_ours(folder: Path) -> str | None:
    """Reason why other users can change files in `folder`, directly or through a folder above it, or None."""
    if not hasattr(os, "getuid"):
        return None
    real = Path(os.path.realpath(folder))
    for each in (real, *real.parents):
        try:
            status = os.stat(each)
        except OSError:
            continue  # missing: its creator will own it, so the folder above decides
        sticky = each != real and bool(status.st_mode & stat.S_ISVTX)  # /tmp: only owners rename
        if (reason := _why(status, sticky)) is not None:
            return f"{each} {reason}"
    return None


def why_file_is_not_ours(handle: int) -> str | None:
    """Reason why other users can change the open file, or None."""
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
    """Whether the group is the private group of the user."""
    if number == 0:
        return True  # root's
    import grp
    import pwd

    try:
        group, user = grp.getgrgid(number), pwd.getpwuid(os.getuid())
    except KeyError:
        return False
    return group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name}
