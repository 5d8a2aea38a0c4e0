:- module(planner_outlook,
          [ low/4,                      % +Program, +Situation, -Chain, -Work
            never/1,                    % -Milliseconds
            reads/6,                    % +Term, +Classes, +Situation, ?Property, ?Subject, -As
            calls/3,                    % +Program, +Situation, -Heads
            lumped/4                    % +Program, +Situation, -Program, -Situation
          ]).

/** <module> What can be said of a program without executing it: bounds, calls, what is under way
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(yall)).
:- use_module(kb_rules(facts), [agent/3, duration/3, effect/4, kind/3]).
:- use_module(kb_rules(capability), [capable/3]).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(transition)).

%!  never(-Milliseconds) is det.
%
%   Longer than any plan: what an impossible program takes.

never(1_000_000_000_000).

%!  low(+Program, +Situation, -Chain, -Work) is det.
%
%   Lower bounds of the longest chain and of the robot time that Program still takes.

low([], _, 0, 0).
low([P|Ps], S, C, W) :- low(P, S, C1, W1), low(Ps, S, C2, W2), C is C1 + C2, W is W1 + W2.
low(test(_), _, 0, 0).
low(choice(_, _, Ps), S, C, W) :- least(P, member(P, Ps), S, C, W).
low(pick(Frame, Step, V, Class, P), S, C, W) :-
    atomic_list_concat([Frame, /, Step], Id),
    least(Bound,
          ( member_of(Class, X, S), \+ excluded(Id, X, S), copy_term(V-P, X-Bound) ),
          S, C, W).
low(picked(_, _, P), S, C, W) :- low(P, S, C, W).
low(if(_, P, Q), S, C, W) :- least(R, member(R, [P, Q]), S, C, W).
low(while(_, _), _, 0, 0).
low(until(P, _), S, C, W) :- low(P, S, C, W).
low(conc(Ps), S, C, W) :- low_all(Ps, S, C, W).
low(foreach(F, Step, Vs, Cond, Inner, P), S, C, W) :-
    (   lasting(Vs, Cond, S)
    ->  instances(F, Step, Vs, Cond, Inner-P, S, Turns),
        low_all(Turns, S, C, W)
    ;   C = 0, W = 0                                % there may be fewer turns by then
    ).
low(call(_, _, Head), S, C, W) :- low_call(Head, S, C, W).
low(scope(_, _, P), S, C, W) :- low(P, S, C, W).
low(running(_), _, 0, 0).                           % counted with the runs

low_all([], _, 0, 0).
low_all([P|Ps], S, C, W) :-
    low(P, S, C1, W1),
    low_all(Ps, S, C2, W2),
    C is max(C1, C2),
    W is W1 + W2.

least(P, Goal, S, C, W) :-
    findall(C0-W0, ( Goal, low(P, S, C0, W0) ), Bounds),
    never(Never),
    foldl([C1-W1, A-B, M-N]>>( M is min(A, C1), N is min(B, W1) ), Bounds, Never-Never, C-W).

low_call(Head, S, C, W) :-
    revision(S, Revision),
    functor(Head, Name, _),
    agent_of(Head, Agent, S),
    (   Agent \== none, \+ capable(Revision, Name, Agent)
    ->  never(C), W = C
    ;   duration(Revision, Head, Duration)
    ->  shortest(Duration, S, C),
        (   Agent == none -> W = 0 ; W = C )
    ;   expansion(low, Head, S, Body),
        low(Body, S, C, W)
    ).

shortest(fixed(Milliseconds), _, Milliseconds).
shortest(travel(_, fluent(_, _), More), _, More) :- !.      % where to is not known yet
shortest(travel(Robot, To, More), S, Milliseconds) :-
    findall(T, travel_time(Robot, _, To, T, S), Times),
    never(Never),
    foldl([T, A, B]>>( B is min(A, T) ), Times, Never, Least),
    Milliseconds is Least + More.

%   No effect changes for which individuals the condition of a for-each holds.
lasting(Vars, Condition, S) :-
    revision(S, Revision),
    \+ ( reads(Condition, Vars, S, Property, X, _),
         effect(Revision, Head, fluent(Property, X), _),
         (   agent(Revision, Head, Robot), Robot == X
         ->  kind(Revision, X, 'Robot')
         ;   true
         ) ).

%!  reads(+Term, +Classes, +Situation, ?Property, ?Subject, -As) is nondet.
%
%   A condition (As = condition) or an argument (As = argument) in a program asks for the value of Property
%   of Subject. Classes are its free variables and their classes, as far as they are known.

reads(Term, Classes, S, Property, X, As) :-
    nonvar(Term),
    reads_(Term, Classes, S, Property, X, As).

reads_(holds(Property, Subject, _), Classes, S, Property, X, condition) :- !,
    subject(Subject, Classes, S, X).
reads_(fluent(Property, Subject), Classes, S, Property, X, argument) :- !,
    subject(Subject, Classes, S, X).
reads_(foreach(_, _, Vars, C, _, P), Classes, S, Property, X, As) :- !,
    append(Vars, Classes, Classes1),
    ( reads(C, Classes1, S, Property, X, As) ; reads(P, Classes1, S, Property, X, As) ).
reads_(pick(_, _, V, Class, P), Classes, S, Property, X, As) :- !,
    reads(P, [V-Class|Classes], S, Property, X, As).
reads_(Term, Classes, S, Property, X, As) :-
    compound(Term),
    arg(_, Term, Part),
    reads(Part, Classes, S, Property, X, As).

subject(Subject, Classes, S, X) :-
    (   nonvar(Subject)
    ->  X = Subject
    ;   member(V-Class, Classes), V == Subject
    ->  member_of(Class, X, S)
    ;   true
    ).

%!  calls(+Program, +Situation, -Heads) is det.
%
%   Every call that some execution may make, as far as it is known before acting: what travel times
%   are needed for, and what can be said of a program that nobody can do.

calls(P, S, Heads) :-
    findall(Head, call_of(P, S, Head), Heads0),
    sort(Heads0, Heads).

call_of([P|Ps], S, H) :- ( call_of(P, S, H) ; call_of(Ps, S, H) ).
call_of(choice(_, _, Ps), S, H) :- call_of(Ps, S, H).
call_of(pick(_, _, V, Class, P), S, H) :- member_of(Class, X, S), copy_term(V-P, X-Q), call_of(Q, S, H).
call_of(picked(_, Pick, P), S, H) :- ( call_of(P, S, H) ; call_of(Pick, S, H) ).
call_of(if(_, P, Q), S, H) :- ( call_of(P, S, H) ; call_of(Q, S, H) ).
call_of(while(_, P), S, H) :- call_of(P, S, H).
call_of(until(P, _), S, H) :- call_of(P, S, H).
call_of(conc(Ps), S, H) :- call_of(Ps, S, H).
call_of(foreach(F, Step, Vs, C, Inner, P), S, H) :-
    instances(F, Step, Vs, C, Inner-P, S, Turns),
    call_of(Turns, S, H).
call_of(scope(_, Head, P), S, H) :- ( H = Head ; call_of(P, S, H) ).
call_of(call(_, _, Head), S, H) :-
    (   H = Head
    ;   revision(S, Revision),
        \+ duration(Revision, Head, _),
        expansion(call, Head, S, Body),
        call_of(Body, S, H)
    ).

%!  lumped(+Program, +Situation, -Program, -Situation) is det.
%
%   For looking ahead from the middle of things: a composite process with a duration model that has
%   begun is one durative step that still takes as long as from where its robot is.

lumped([P|Ps], S, [P1|Ps], S1) :- !, lumped(P, S, P1, S1).
lumped(conc(Ps), S, conc(Qs), S1) :- !, foldl_lumped(Ps, S, Qs, S1).
lumped(picked(Id, Pick, P), S, picked(Id, Pick, Q), S1) :- !, lumped(P, S, Q, S1).
lumped(scope(Id, Head, P), S, Q, S1) :- !,
    (   one_step(Head, Duration, S)
    ->  agent_of(Head, Agent, S),
        stop_agent(Agent, S, S0),
        (   milliseconds(Duration, Milliseconds, S0)
        ->  release_robot(Agent, Id, S0, S2),
            start(Id, Head, Agent, Milliseconds, S2, S1),
            Q = running(Id)
        ;   S1 = S0,
            Q = choice(Id, no_way, [])              % without a branch: cannot be done
        )
    ;   lumped(P, S, P1, S1),
        Q = scope(Id, Head, P1)
    ).
lumped(P, S, P, S).

foldl_lumped([], S, [], S).
foldl_lumped([P|Ps], S, [Q|Qs], S1) :-
    lumped(P, S, Q, S0),
    foldl_lumped(Ps, S0, Qs, S1).

stop_agent(Agent, S0, S) :-
    running(S0, Runs),
    (   memberchk(run(_, Agent, Id, _), Runs) -> stop(Id, S0, S) ; S = S0 ).
