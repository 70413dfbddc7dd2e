"""Logs of single axes in a control loop, without a tip; written from the contract alone."""
