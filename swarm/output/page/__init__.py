"""Reports: pages in HTML that need nothing besides themselves."""
