"""The door of the shell: command line, exit codes, progress, generated reference; stories are called here, not
told.
"""
