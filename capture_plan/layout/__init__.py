"""Landmarks: where to put how few, what was proved about their number, and what they are worth."""
