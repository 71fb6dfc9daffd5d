"""Plans facial capture sessions: markers to place, expressions to scan, and every page the set needs."""
