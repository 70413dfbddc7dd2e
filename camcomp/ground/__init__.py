"""Shared data types and tools: arrays, errors, rules, files, tables, plug-in shelves; it imports no other folder."""
