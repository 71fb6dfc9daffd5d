"""Animation curves: blendshape weights over time, out of tables, text and JSON."""
