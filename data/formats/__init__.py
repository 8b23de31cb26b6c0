"""Files and frames of users, read and written."""
