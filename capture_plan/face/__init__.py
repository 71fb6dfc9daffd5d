"""Where the face of a rig is: axes, unit, eyes, mouth, sides, each from all evidence at hand, and with a doubt."""
