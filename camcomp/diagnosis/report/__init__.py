"""What a diagnosis prints and draws."""
