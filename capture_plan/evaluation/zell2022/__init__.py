"""Zell & McDonnell 2022, Compact facial landmark layouts: what the paper compares, on your own rig."""
