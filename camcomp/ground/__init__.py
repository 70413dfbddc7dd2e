"""Nouns and small tools that every room uses (arrays, errors, rules, files, tables, plug-in shelves); nothing here
knows of machines or programs of a certain kind, and nothing here imports another room.
"""
