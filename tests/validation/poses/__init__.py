"""Static poses of arms; written from the contract alone."""
