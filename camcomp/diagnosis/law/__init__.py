"""A law for what no effect explains: candidate terms, a sparse choice on withheld runs, a smooth map, words for it."""
