"""What a control makes of the moves of a program: lines merged, corners blended, the speed along them; no machine, no text."""
