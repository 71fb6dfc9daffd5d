"""From any file to a rig: the format's reader, what belongs to the head, axes, unit, skin and crop."""
