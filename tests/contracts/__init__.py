"""Laws that every member of a plug-in folder keeps, and users' own plug-ins."""
