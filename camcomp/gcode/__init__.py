"""NC text to tool path and back, byte for byte where nothing changes; dialect-independent reading and rewriting
live here, no machine does.
"""
