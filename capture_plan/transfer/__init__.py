"""What a packing is worth: the rig of another face, built from its neutral and its scanned expressions."""
