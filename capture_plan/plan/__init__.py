"""The plan: its settings and inputs, the record, making and changing it, and its summary in words."""
