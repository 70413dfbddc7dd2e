"""What a compensation prints and draws: tables, page, figures."""
