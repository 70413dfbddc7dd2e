"""Blind truth: logs of single axes in a control loop, without a tip. Written from the contract alone; nothing of camcomp in it."""
