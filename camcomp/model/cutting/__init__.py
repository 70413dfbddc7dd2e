"""Cutting force along a path: pieces that cut, engagement, and the averaged models behind the force plug-ins."""
