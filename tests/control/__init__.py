"""The model of the controller against LinuxCNC's planner: corners, feeds, times."""
