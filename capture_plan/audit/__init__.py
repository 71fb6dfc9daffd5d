"""What a rig allows, and what in it needs a person's look, before anything is planned."""
