"""Tool tables of controls and CAM systems: one reader per kind of file (`camcomp/plugins/tool_tables.py`)."""
