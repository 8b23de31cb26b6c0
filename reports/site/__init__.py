"""The stored results as a site: static pages that open from disk and load nothing from a network."""
