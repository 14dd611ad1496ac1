"""Steps of soft balls that press on one another and on walls."""
