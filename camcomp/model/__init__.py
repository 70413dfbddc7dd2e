"""Forward model of machine, controller and cut, shared by compensation and diagnosis; it imports neither of them."""
