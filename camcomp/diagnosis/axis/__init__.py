"""The study of logs of single axes without a tip."""
