:- module(kb_capability,
          [ capable/3,                  % +Revision, +Process, ?Robot
            missing/4                   % +Revision, +Process, +Robot, -What
          ]).

/** <module> Which robot can do which process

A process requires capabilities of its robot (classes of robots); what a composite process requires
follows from what it performs. The reasoner has found which robots belong to those classes. A robot that does not
answer can do nothing until it does again.
*/

:- use_module(kb_rules(facts), [fluent/4, kind/3, requires/3]).

%!  capable(+Revision, +Process, +Robot) is semidet.

capable(Revision, Process, Robot) :-
    \+ missing(Revision, Process, Robot, _).

%!  missing(+Revision, +Process, +Robot, -What) is nondet.
%
%   What the robot lacks for the process: a capability that it requires, or `isReachable`.

missing(Revision, Process, Robot, Capability) :-
    requires(Revision, Process, Capability),
    \+ kind(Revision, Robot, Capability).
missing(Revision, _, Robot, isReachable) :-
    fluent(Revision, isReachable, Robot, false).
