"""camcomp for programs: what `import camcomp` offers, and what every verb of the command line calls."""
