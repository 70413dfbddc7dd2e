"""A whole LinuxCNC simulation drives the compensated programs of an Orthoglide."""
