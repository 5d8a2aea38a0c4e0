:- module(kb_capability,
          [ capable/3,                  % +Revision, +Process, ?Robot
            missing/4                   % +Revision, +Process, +Robot, -Capability
          ]).

/** <module> Which robot can do which process

A process requires capabilities of its robot (classes of robots); what a composite process requires
follows from what it performs. The reasoner has found which robots belong to those classes.
*/

:- use_module(kb_rules(facts), [kind/3, requires/3]).

%!  capable(+Revision, +Process, +Robot) is semidet.

capable(Revision, Process, Robot) :-
    \+ missing(Revision, Process, Robot, _).

%!  missing(+Revision, +Process, +Robot, -Capability) is nondet.
%
%   The robot lacks a capability that the process requires.

missing(Revision, Process, Robot, Capability) :-
    requires(Revision, Process, Capability),
    \+ kind(Revision, Robot, Capability).
