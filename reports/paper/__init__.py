"""The paper's tables and claims beside those computed here."""
