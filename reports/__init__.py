"""The report: figures, findings in words, and one self-contained page; cards for other codes come here too."""
