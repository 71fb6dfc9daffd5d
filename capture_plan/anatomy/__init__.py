"""Anatomy of a face that was found: regions, zones, sides, pairs, and what each blendshape does to it."""
