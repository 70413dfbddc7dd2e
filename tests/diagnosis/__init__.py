"""Answers of `camcomp diagnose` on experiments whose causes are known, from log to verdict."""
