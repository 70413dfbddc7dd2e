"""Python interface of camcomp: functions of `import camcomp`, which the verbs of the command line call."""
