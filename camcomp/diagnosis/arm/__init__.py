"""The study of static poses of a serial arm."""
