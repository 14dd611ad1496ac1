"""The time of impact of a free flight with walls at rest and in motion."""
