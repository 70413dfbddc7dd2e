"""Truth machines: energy minima, drives in time, guideways, arms; they import nothing of camcomp."""
