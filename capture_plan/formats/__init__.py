"""One reader for each format that artists send; `rig.read` chooses among them."""
