"""Le, Zhu & Deng 2013, Marker optimization for facial motion acquisition: its methods and figures, on your own take."""
