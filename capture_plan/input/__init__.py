"""What comes in from outside: files and archives read within bounds, and documents that people write."""
