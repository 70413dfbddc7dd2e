"""Import of recordings of other systems as logs: readers of file formats, assignment of columns, joining of files."""
