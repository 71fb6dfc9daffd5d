"""Layouts and lists judged against others: baselines, published layouts, noise, and the three papers."""
