"""One reader for each format that artists send; `reader.read` chooses among them."""
