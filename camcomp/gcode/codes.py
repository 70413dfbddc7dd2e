"""G and M codes as data: modal groups, and refused codes with reasons. Codes count in tenths, so G59.1 is 591.

Group numbers are those of RS274/NGC: 0 not modal, 1 motion, 2 plane, 3 distance, 4 arc centres, 5 feed mode, 6 units,
7 cutter radius, 8 tool length, 10 retract, 12 work offset, 13 path control, 14 spindle mode, 15 lathe diameter.
"""

GROUPS: dict[int, int] = {
    **dict.fromkeys((40, 100, 280, 281, 300, 301, 520, 530, 920, 921, 922, 923), 0),
    **dict.fromkeys((0, 10, 20, 30, 800), 1),
    **dict.fromkeys((730, 810, 820, 830, 840, 850, 860, 870, 880, 890), 1),
    **dict.fromkeys((170, 180, 190), 2),
    **dict.fromkeys((900, 910), 3),
    **dict.fromkeys((901, 911), 4),
    **dict.fromkeys((930, 940, 950), 5),
    **dict.fromkeys((200, 210), 6),
    400: 7,
    **dict.fromkeys((430, 431, 490), 8),
    **dict.fromkeys((980, 990), 10),
    **dict.fromkeys((540, 550, 560, 570, 580, 590, 591, 592, 593), 12),
    **dict.fromkeys((610, 611, 640), 13),
    970: 14,
    80: 15,
}

CYCLES = frozenset((730, 740, 760, 810, 820, 830, 840, 850, 860, 870, 880, 890))
HOMES = frozenset((280, 300, 740, 750))  # as codes of group 0; 74 and 75: Sinumerik
EXACT_STOPS = frozenset((600, 610, 611))  # 60: Sinumerik
EXACT_STOP_ONCE = 19  # modal group of G9, which stops after its own block only
MACHINE_MOVES = frozenset((530, 1530))
AXIS_USERS = frozenset((100, 280, 300, 520, 740, 750, 920))  # of group 0: use the axis words of their block
WORK_OFFSETS = {540: 1, 550: 2, 560: 3, 570: 4, 580: 5, 590: 6, 591: 7, 592: 8, 593: 9}
OFFSET_NAMES = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")

REFUSED: dict[int, tuple[str, str]] = {
    **dict.fromkeys((410, 411, 420, 421), ("CC114", "cutter radius compensation")),
    **dict.fromkeys((150, 160), ("CC116", "polar coordinates")),
    **dict.fromkeys((500, 510, 511), ("CC117", "scaling or mirroring")),
    **dict.fromkeys((680, 681, 682, 683, 690, 691), ("CC118", "for rotated coordinates")),
    **dict.fromkeys((434, 435), ("CC115", "for machines with rotary axes")),
    **dict.fromkeys((50, 51, 52, 53, 62, 63), ("CC119", "splines")),
    **dict.fromkeys((330, 331, 760), ("CC120", "spindle-synchronous motion")),
    **dict.fromkeys((310, 380, 382, 383, 384, 385), ("CC121", "probing")),
    **dict.fromkeys((70, 960, 700, 710, 711, 712, 720, 721, 722), ("CC122", "for turning")),
}
CANCELS = frozenset((150, 500, 690, 691))  # of those, the codes that switch the mode off

PLAIN_M = frozenset((0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 30, 48, 49, 60))
KNOWN_M = PLAIN_M | frozenset((19, 50, 51, 52, 53, 61, 62, 63, 64, 65, 66, 67, 68))
CALLS_M = frozenset((96, 97, 98, 99, 198))
SAVES = frozenset((70, 71, 72, 73))
STOPS = frozenset((0, 1, 2, 30, 60))
ENDS = frozenset((2, 30))
# Codes for which a controller stops the motion, as LinuxCNC does; M62, M63, M67 act during the motion.
WAITS_M = frozenset((3, 4, 5, 6, 7, 8, 9, 19, 61, 64, 65, 66, 68))
WAITS_G = frozenset((40, 430, 431, 490, 520, 920, 921, 922, 923))
GROUPS_M: dict[int, int] = {
    **dict.fromkeys((0, 1, 2, 30, 60), 4),
    6: 6,
    61: 6,
    **dict.fromkeys((3, 4, 5), 7),
    **dict.fromkeys((48, 49), 9),
}


def code_name(code: int) -> str:
    """`G59.1` of 591."""
    return f"G{code // 10}" if code % 10 == 0 else f"G{code // 10}.{code % 10}"
